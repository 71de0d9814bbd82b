// SPDX-License-Identifier: MIT
#include "client/name_watch.h"

#include <gtest/gtest.h>

#include <mpf/message_server.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class NameWatchTest : public testing::Test {
 protected:
  Watchdog watchdog_{"name watch"};
  TestBackplane backplane_;
  Endpoint endpoint_{backplane_,      layout::SegmentKind::clientWindow,
                     std::string(),   Rights{.mode = 0600},
                     WaitMode::block, [](layout::SegmentHeader&) {}};
  NameWatch names_{endpoint_};
};

TEST_F(NameWatchTest, ItsStartCountsAsAChange) {
  EXPECT_FALSE(names_.takeChange());

  names_.start();

  EXPECT_TRUE(names_.isRunning());
  EXPECT_TRUE(names_.takeChange());
  EXPECT_FALSE(names_.takeChange());
  names_.start();  // it runs already
  EXPECT_FALSE(names_.takeChange());
}

TEST_F(NameWatchTest, AServerThatAppearsWakesTheEndpoint) {
  names_.start();
  static_cast<void>(names_.takeChange());
  static_cast<void>(endpoint_.takeLocalEvent());

  const MessageServer server(backplane_, "dac");

  while (!names_.takeChange()) {
    endpoint_.wait(Deadline::never());
    static_cast<void>(endpoint_.takeLocalEvent());
  }
}

TEST_F(NameWatchTest, CanBeStartedAgain) {
  names_.start();
  names_.stop();
  EXPECT_FALSE(names_.isRunning());
  static_cast<void>(names_.takeChange());

  names_.start();

  EXPECT_TRUE(names_.takeChange());
}

}  // namespace
}  // namespace mpf::test
