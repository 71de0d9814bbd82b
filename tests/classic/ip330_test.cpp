// SPDX-License-Identifier: MIT
// The manual's ip330 server as a process, on a model of the board, with a client of the new API.
#include <gtest/gtest.h>

#include <mpf/sync_client.h>

#include "drivers/ip330/ip330_model.h"
#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class ClassicIp330Test : public testing::Test {
 protected:
  ClassicIp330Test() {
    ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);
    server_.emplace(std::vector<std::string>{MPF_TEST_CLASSIC_IP330, "adc", "3=dc:-1.25"});
    client_.emplace(backplane_, "adc");
  }
  ~ClassicIp330Test() override { client_.reset(); }
  // NOLINTNEXTLINE(bugprone-easily-swappable-parameters): as the fields of the message
  Int32 read(int channel, int gain) {
    auto answer = client_->call(Int32Message({.address = channel, .value = gain}), 600s);
    EXPECT_TRUE(answer) << answer.why();
    const auto reply = answer.as<Int32>();
    return reply ? **reply : Int32{.status = -99};
  }
  Watchdog watchdog_{"the manual's ip330 server"};
  TestBackplane backplane_;
  std::optional<Program> server_;
  std::optional<SyncClient> client_;
};

TEST_F(ClassicIp330Test, RepliesWithTheMeanOfTheChannelAtItsGain) {
  for (int gain = 0; gain < kIp330Gains; ++gain) {
    const auto reply = read(3, gain);
    EXPECT_EQ(reply.status, 0);
    EXPECT_EQ(reply.address, 3);
    const auto ideal = Ip330Model::idealCode(Ip330Range::minus5to5, gain, -1.25);
    EXPECT_NEAR(reply.value, std::clamp(ideal, 0.0, 65535.0), 2) << "gain " << gain;
  }
}

TEST_F(ClassicIp330Test, AnIllegalGainOrChannelHasAStatus) {
  EXPECT_EQ(read(3, 4).status, -1);
  EXPECT_EQ(read(16, 0).status, -1);
}

TEST_F(ClassicIp330Test, ARequestOfAnotherTypeIsRefused) {
  EXPECT_EQ(client_->call(Float64Message(), 600s).fate(), Fate::refused);
}

}  // namespace
}  // namespace mpf::test
