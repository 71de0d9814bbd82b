// SPDX-License-Identifier: MIT
// Polling: the event loop stays awake after traffic, and sleeps later.
#include "router/polling.h"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/router/busy_tasks.h"
#include "tests/support/replaced_yield.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using router::Polling;

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

class PollingTest : public testing::Test {
 public:
  ~PollingTest() noexcept override = default;

 protected:
  void add(router::Polled& window) {
    polling_.noteTraffic();
    polling_.addWindow(window);
  }
  void wait() { io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope); }

  const Watchdog watchdog_{"polling"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  router::DueWrites writes_{io_.provider->getTimer()};
  Polling polling_{io_.unixEventPort, writes_};
};

TEST_F(PollingTest, EndsAWhileAfterTheLastTraffic) {
  EXPECT_FALSE(polling_.isPolling());

  polling_.noteTraffic();

  EXPECT_TRUE(polling_.isPolling());
  while (polling_.isPolling()) wait();
  while (!polling_.isPolling()) polling_.noteTraffic();  // at once, unless a yield was long
}

TEST_F(PollingTest, SleepsForSomeTrafficWhenOthersUseTheProcessor) {
  Window window;
  bool yielded = false;
  const std::function<void()> yield = [&] {
    yielded = true;
    othersRun(std::chrono::milliseconds(2));
  };
  const ReplacedYield replaced(yield);
  std::optional<Polling> polling;
  while (!yielded) {  // on a busy host, the time for polling may pass before
    polling.emplace(io_.unixEventPort, writes_).noteTraffic();
    while (polling->isPolling()) wait();
  }

  polling->noteTraffic();
  polling->addWindow(window);

  EXPECT_FALSE(polling->isPolling());
  EXPECT_FALSE(window.isPolled);
  while (!window.isPolled) {
    polling->noteTraffic();
    polling->addWindow(window);
  }
  while (polling->isPolling()) wait();
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

// As while many peers send all the time.
TEST_F(PollingTest, PollsThoughOtherTasksAreAlwaysReady) {
  Window window;
  while (!window.isPolled) add(window);
  const BusyTasks busy(io_);

  while (window.polls == 0) wait();

  while (polling_.isPolling()) wait();
}

// As the write of a message that led to the traffic.
TEST_F(PollingTest, RunsTheTasksThatWaitedWhenItBegan) {
  struct Busy final : router::Polled {
    explicit Busy(Polling& of) : polling(of) {}
    void poll() override {
      if (++polls < 1000) polling.noteTraffic();
    }
    void setPolled(bool) override {}
    Polling& polling;
    int polls = 0;
  };
  Busy busy(polling_);
  int pollsBefore = -1;
  auto write = kj::evalLast([&] { pollsBefore = busy.polls; }).eagerlyEvaluate(nullptr);

  add(busy);
  while (polling_.isPolling()) wait();

  EXPECT_EQ(pollsBefore, 0);
}

TEST_F(PollingTest, PollsAWindowUntilItSleepsAndOnceMore) {
  Window window;

  add(window);

  EXPECT_TRUE(window.isPolled);
  while (polling_.isPolling()) wait();
  EXPECT_FALSE(window.isPolled);
  EXPECT_EQ(window.pollsSinceChange, 1) << "what arrived while nobody was woken";
}

TEST_F(PollingTest, LooksForAnswersAfterTheirSendersHaveRun) {
  Window window;
  int pollsAtYield = -1;
  polling_.lookForAnswers();
  EXPECT_EQ(window.polls, 0) << "it does not poll";
  while (!window.isPolled) add(window);
  const auto before = window.polls;

  {
    const std::function<void()> yield = [&] { pollsAtYield = window.polls; };
    const ReplacedYield replaced(yield);
    polling_.lookForAnswers();
  }

  EXPECT_EQ(pollsAtYield, before);
  EXPECT_EQ(window.polls, before + 1);
  while (polling_.isPolling()) wait();
}

TEST_F(PollingTest, EndsWhenOthersUseTheProcessorWhileItLooksForAnswers) {
  Window window;
  while (!window.isPolled) add(window);

  {
    const std::function<void()> yield = [] { othersRun(std::chrono::milliseconds(2)); };
    const ReplacedYield replaced(yield);
    polling_.lookForAnswers();
  }
  const auto polls = window.polls;
  polling_.lookForAnswers();
  EXPECT_EQ(window.polls, polls) << "it gives the processor up once";
  while (polling_.isPolling()) wait();

  add(window);
  EXPECT_FALSE(polling_.isPolling()) << "nor does it poll for the next traffic";
  while (!polling_.isPolling()) add(window);
  while (polling_.isPolling()) wait();
}

TEST_F(PollingTest, AnErrorOfAWindowEndsTheRouterNotTheLineThatLooksForAnswers) {
  struct Faulty final : router::Polled {
    void poll() override {
      if (std::exchange(isFaulty, false)) throw std::runtime_error("no memory");
    }
    void setPolled(bool polled) override { isPolled = polled; }
    bool isFaulty = false;
    bool isPolled = false;
  };
  Faulty window;
  while (!window.isPolled) add(window);
  window.isFaulty = true;

  EXPECT_NO_THROW(polling_.lookForAnswers());

  EXPECT_FALSE(window.isFaulty) << "the window was polled";
  EXPECT_THROW(wait(), kj::Exception);
  while (polling_.isPolling()) wait();
}

// A turn must find what the handlers of the line have put into the rings.
TEST_F(PollingTest, HandlesWhatTheDescriptorsBroughtBeforeItPolls) {
  Window window;
  int pollsBefore = -1;
  auto pipe = io_.provider->newTwoWayPipe();
  char byte = 0;
  auto read = pipe.ends[1]->read(&byte, 1).then([&] { pollsBefore = window.polls; });
  auto handled = read.eagerlyEvaluate(nullptr);
  while (!window.isPolled) add(window);

  pipe.ends[0]->write("x", 1).wait(io_.waitScope);
  while (polling_.isPolling()) wait();

  EXPECT_EQ(pollsBefore, 0);
}

TEST_F(PollingTest, PollsTheWindowsThatWereBusyLast) {
  std::array<Window, router::PolledSet::kMax + 1> windows;
  for (auto& window : windows) {
    add(windows.front());
    add(window);
  }

  EXPECT_TRUE(windows.front().isPolled) << "it was busy all the time";
  EXPECT_FALSE(windows[1].isPolled);
  EXPECT_EQ(windows[1].pollsSinceChange, 1);
  for (std::size_t at = 2; at < windows.size(); ++at) EXPECT_TRUE(windows[at].isPolled);
  while (polling_.isPolling()) wait();
}

// The last look at a window that is replaced finds messages.
TEST_F(PollingTest, PollsNoMoreThanItsMaximum) {
  struct Busy final : router::Polled {
    explicit Busy(Polling& of) : polling(of) {}
    void poll() override { polling.addWindow(*this); }
    void setPolled(bool polled) override { isPolled = polled; }
    Polling& polling;
    bool isPolled = false;
  };
  std::vector<std::unique_ptr<Busy>> windows;
  for (std::size_t i = 0; i < 2 * router::PolledSet::kMax; ++i) {
    windows.push_back(std::make_unique<Busy>(polling_));
    add(*windows.back());
  }

  EXPECT_EQ(std::ranges::count_if(windows, [](const auto& each) { return each->isPolled; }),
            static_cast<std::ptrdiff_t>(router::PolledSet::kMax));
  EXPECT_TRUE(windows.back()->isPolled);
  for (const auto& window : windows) polling_.remove(*window);
}

// The last look at one window leads to the end of another one.
TEST_F(PollingTest, ForgetsAWindowThatIsDestroyedWhilePollingEnds) {
  struct Killer final : router::Polled {
    Killer(Polling& of, Window& other) : polling(of), victim(other) {}
    void poll() override {
      if (!isPolled) polling.remove(victim);
    }
    void setPolled(bool polled) override { isPolled = polled; }
    Polling& polling;
    Window& victim;
    bool isPolled = false;
  };
  Window window;
  Killer killer(polling_, window);
  add(killer);
  add(window);

  while (polling_.isPolling()) wait();

  EXPECT_TRUE(window.isPolled) << "it is not touched after remove()";
}

TEST_F(PollingTest, ForgetsAWindowThatIsDestroyed) {
  Window window;
  add(window);

  polling_.remove(window);

  while (polling_.isPolling()) wait();
  EXPECT_EQ(window.polls, 0);
}

}  // namespace
}  // namespace mpf::test
