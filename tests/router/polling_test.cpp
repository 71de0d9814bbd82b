// SPDX-License-Identifier: MIT
// Polling: the event loop stays awake after traffic, and sleeps later.
#include "router/polling.h"

#include <array>
#include <gtest/gtest.h>
#include <kj/async-io.h>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using router::Polling;

class PollingTest : public testing::Test {
 public:
  ~PollingTest() noexcept override = default;

 protected:
  void wait() { io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope); }

  const Watchdog watchdog_{"polling"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  Polling polling_{io_.unixEventPort};
};

TEST_F(PollingTest, EndsAWhileAfterTheLastTraffic) {
  EXPECT_FALSE(polling_.isPolling());

  polling_.noteTraffic();

  EXPECT_TRUE(polling_.isPolling());
  while (polling_.isPolling()) wait();
  polling_.noteTraffic();
  EXPECT_TRUE(polling_.isPolling()) << "again";
}

TEST_F(PollingTest, HandlesEventsOfDescriptors) {
  auto pipe = io_.provider->newTwoWayPipe();
  char byte = 0;
  auto read = pipe.ends[1]->read(&byte, 1).eagerlyEvaluate(nullptr);
  for (int i = 0; i < 3; ++i) {
    polling_.noteTraffic();
    wait();
  }

  polling_.noteTraffic();
  pipe.ends[0]->write("x", 1).wait(io_.waitScope);
  read.wait(io_.waitScope);

  EXPECT_EQ(byte, 'x');
}

struct Window final : router::Polled {
  void poll() override {
    ++polls;
    pollsSinceChange++;
  }
  void setPolled(bool polled) override {
    isPolled = polled;
    pollsSinceChange = 0;
  }
  int polls = 0;
  int pollsSinceChange = 0;
  bool isPolled = false;
};

TEST_F(PollingTest, PollsAWindowUntilItSleepsAndOnceMore) {
  Window window;

  polling_.add(window);

  EXPECT_TRUE(window.isPolled);
  while (polling_.isPolling()) wait();
  EXPECT_FALSE(window.isPolled);
  EXPECT_EQ(window.pollsSinceChange, 1) << "what arrived while nobody was woken";
  EXPECT_GT(window.polls, 1);
}

TEST_F(PollingTest, PollsTheWindowsThatWereBusyLast) {
  std::array<Window, Polling::kMaxWindows + 1> windows;
  for (auto& window : windows) {
    polling_.add(windows.front());
    polling_.add(window);
  }

  EXPECT_TRUE(windows.front().isPolled) << "it was busy all the time";
  EXPECT_FALSE(windows[1].isPolled);
  EXPECT_EQ(windows[1].pollsSinceChange, 1);
  for (std::size_t at = 2; at < windows.size(); ++at) EXPECT_TRUE(windows[at].isPolled);
  while (polling_.isPolling()) wait();
}

TEST_F(PollingTest, ForgetsAWindowThatIsDestroyed) {
  Window window;
  polling_.add(window);

  polling_.remove(window);

  while (polling_.isPolling()) wait();
  EXPECT_EQ(window.polls, 0);
}

}  // namespace
}  // namespace mpf::test
