// SPDX-License-Identifier: MIT
#include "base/stop_bell.h"

#include <signal.h>

#include <gtest/gtest.h>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

TEST(StopBell, ReturnsForASignalReceivedBeforeTheWait) {
  const Watchdog watchdog("stop bell test");
  for (const int signal : {SIGINT, SIGTERM}) {
    StopBell bell;
    EXPECT_FALSE(bell.wait(0ms));
    ::raise(signal);
    EXPECT_TRUE(bell.wait(0ms));
    bell.wait();
  }
}

TEST(StopBell, ReturnsForASignalReceivedDuringTheWait) {
  const Watchdog watchdog("stop bell test");
  StopBell bell;
  std::thread stopping([] { ::kill(::getpid(), SIGTERM); });
  bell.wait();
  stopping.join();
}

TEST(StopBell, WakesAllObjectsThatWait) {
  StopBell one;
  StopBell other;
  ::raise(SIGTERM);
  EXPECT_TRUE(one.wait(0ms));
  EXPECT_TRUE(other.wait(0ms));
}

}  // namespace
}  // namespace mpf::test
