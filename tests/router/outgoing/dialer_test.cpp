// SPDX-License-Identifier: MIT
// Dialer: the steps of a connection, and the texts of their failures.
#include "router/outgoing/dialer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kj/debug.h>
#include <memory>

#include "tests/router/held_network.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

using testing::HasSubstr;

class DialerTest : public testing::Test {
 public:
  ~DialerTest() noexcept override = default;

 protected:
  // Begins to connect. The look-up waits in io_.network().lookups[0].
  void connect() {
    connecting_ =
        dialer_.dial()
            .then([this](kj::Own<kj::AsyncIoStream> stream) { stream_ = kj::mv(stream); },
                  [this](kj::Exception&& error) { problem_ = toStd(error.getDescription()); })
            .eagerlyEvaluate(nullptr);
    io_.run();
  }
  void runUntilDone() { connecting_.wait(io_.context().waitScope); }
  auto& lookup() { return *io_.network().lookups.at(0); }

  const mpf::test::Watchdog watchdog_{"dialer"};
  const mpf::test::TestBackplane backplane_;
  HeldIo io_;
  Statistics statistics_{backplane_, "test"};
  ServerMonitors monitors_{backplane_, io_.context().unixEventPort, [] {}};
  RouterContext context_{.port = io_.context().unixEventPort,
                         .network = io_.network(),
                         .timer = io_.context().provider->getTimer(),
                         .backplane = backplane_,
                         .log = Log([](Log::Level, const std::string&) {}),
                         .statistics = statistics_,
                         .monitors = monitors_,
                         .config = {},
                         .tls = nullptr};
  const Remote remote_{.locations = {1},
                       .address = parseAddress("slow.lab:9900"),
                       .security = Security::plain,
                       .tlsName = {}};
  Dialer dialer_{context_, remote_};
  kj::Own<kj::AsyncIoStream> stream_;
  std::string problem_;
  kj::Promise<void> connecting_ = nullptr;
};

TEST_F(DialerTest, NamesAFailedLookUp) {
  connect();

  lookup().reject(KJ_EXCEPTION(FAILED, "gai_strerror(status) = Name or service not known"));
  runUntilDone();

  EXPECT_EQ(problem_, "the look-up of slow.lab failed: Name or service not known");
}

TEST_F(DialerTest, NamesALookUpThatTakesTooLong) {
  context_.config.limits.deadTime = std::chrono::milliseconds(20);
  connect();

  runUntilDone();

  EXPECT_EQ(problem_, "the look-up of slow.lab took longer than 20ms (dead-time)");
}

// A look-up cannot be stopped: another one for each attempt would use up threads.
TEST_F(DialerTest, WaitsForALookUpThatTookTooLongInsteadOfStartingAnother) {
  context_.config.limits.deadTime = std::chrono::milliseconds(20);
  connect();
  runUntilDone();
  connect();
  runUntilDone();
  ASSERT_EQ(io_.network().lookups.size(), 1u);
  ASSERT_TRUE(lookup().isWaiting());

  lookup().reject(KJ_EXCEPTION(FAILED, "gai_strerror(status) = Name or service not known"));
  io_.run();
  connect();
  runUntilDone();

  EXPECT_EQ(problem_, "the look-up of slow.lab failed: Name or service not known");
  EXPECT_EQ(io_.network().lookups.size(), 1u);
  connect();
  EXPECT_EQ(io_.network().lookups.size(), 2u) << "each result is used once";
}

TEST_F(DialerTest, RefusesAPublicAddressOverPlainTcp) {
  connect();

  lookup().fulfill(io_.addressOf("8.8.8.8:9900"));
  runUntilDone();

  EXPECT_THAT(problem_, HasSubstr("8.8.8.8:9900 is a public address: use TLS"));
}

}  // namespace
}  // namespace mpf::router::test
