// SPDX-License-Identifier: MIT
#include "client/programs/echo_client.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include <mpf/message_server.h>

#include "tests/server/programs/command_line.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class EchoClientTest : public testing::Test {
 protected:
  void TearDown() override {
    server_.interrupt();
    if (serving_.joinable()) serving_.join();
  }
  void serve(std::function<void(Int32&)> handler) {
    server_.on<Int32>(std::move(handler));
    serving_ = std::thread([this] { server_.run(); });
  }
  // Runs the program. Its output is in out_ and errors_.
  std::optional<int> run(std::vector<std::string> words) {
    words.insert(words.end(), {"--backplane", backplane_.name()});
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const auto status =
        statusOf([this](int argc, char** argv) { return runEchoClient(argc, argv, echo_); }, words);
    out_ = testing::internal::GetCapturedStdout();
    errors_ = testing::internal::GetCapturedStderr();
    return status;
  }

  const Watchdog watchdog_{"echo client test"};
  const TestBackplane backplane_;
  MessageServer server_{backplane_, "Int32"};
  std::thread serving_;
  EchoClient echo_{"mpf-x-client",
                   "Int32",
                   "Int32 message",
                   true,
                   [](int i, std::size_t bytes) {
                     return Int32Message({.extra = static_cast<std::int32_t>(bytes), .value = i});
                   },
                   [](int i, std::size_t, const Message& reply) {
                     const auto* const int32 = reply.tryAs<Int32>();
                     return int32 != nullptr && int32->value == i;
                   }};
  std::string out_;
  std::string errors_;
};

TEST_F(EchoClientTest, SendsTheMessagesAndReportsTheirRoundTrips) {
  std::vector<std::int32_t> values, sizes;
  serve([&](Int32& request) {
    values.push_back(request.value);
    sizes.push_back(request.extra);
  });

  EXPECT_EQ(run({"--count", "3", "--bytes", "7", "--timeout", "60"}), 0);

  EXPECT_THAT(out_, StartsWith("3 came back, 0 did not; round trip: p50 "));
  EXPECT_THAT(errors_, IsEmpty());
  EXPECT_THAT(values, testing::ElementsAre(0, 1, 2));
  EXPECT_THAT(sizes, testing::Each(7));
}

TEST_F(EchoClientTest, FailsWhenAReplyDiffers) {
  serve([](Int32& request) { request.value += request.value == 1 ? 1 : 0; });

  EXPECT_EQ(run({"--count", "3", "--timeout", "60"}), 1);

  EXPECT_THAT(out_, StartsWith("2 came back, 1 did not; round trip: "));
  EXPECT_EQ(errors_, "message 1: the reply differs from the message\n");
}

TEST_F(EchoClientTest, SaysWhyAServerIsNotReached) {
  EXPECT_EQ(run({"nobody", "--count", "2", "--timeout", "1ms"}), 1);

  EXPECT_EQ(out_, "0 came back, 2 did not\n");
  EXPECT_THAT(errors_, HasSubstr("message 0: not sent: not connected: server \"nobody\" at "
                                 "location 0 is not running\n"));
}

TEST_F(EchoClientTest, ReportsManyFailuresInFewLines) {
  EXPECT_EQ(run({"nobody", "--count", "100", "--timeout", "1ms"}), 1);

  EXPECT_EQ(out_, "0 came back, 100 did not\n");
  EXPECT_LT(std::ranges::count(errors_, '\n'), 50);
  EXPECT_THAT(errors_, HasSubstr("message 99: "));
}

TEST_F(EchoClientTest, RefusesInvalidArguments) {
  EXPECT_EQ(run({"--count", "0"}), 2);
  EXPECT_THAT(errors_, HasSubstr("--count: 0 is out of range: use 1 to 2147483647"));
  EXPECT_EQ(run({"--timeout", "0"}), 2);
  EXPECT_THAT(errors_, HasSubstr("--timeout: 0 is out of range: use more than 0s"));
  EXPECT_EQ(run({"--bytes", "1073741825"}), 2);
  echo_.isArray = false;
  EXPECT_EQ(run({"--bytes", "7"}), 2) << "a message without an array has no size";
}

}  // namespace
}  // namespace mpf::test
