// SPDX-License-Identifier: MIT
#include "client/command_queue.h"

#include <gtest/gtest.h>
#include <latch>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class CommandQueueTest : public testing::Test {
 protected:
  [[nodiscard]] CommandQueue::Command note(char name) {
    return [this, name] { ran_ += name; };
  }
  // Calls `work` while another thread runs the dispatcher.
  template <class Work>
  void besideARunner(const Work& work) {
    std::latch runs(1);
    std::latch mayEnd(1);
    std::thread runner([&] {
      lock_.acquire([] {});
      const RunnerGuard guard(&lock_);
      runs.count_down();
      mayEnd.wait();
    });
    runs.wait();
    work();
    mayEnd.count_down();
    runner.join();
  }

  Watchdog watchdog_{"command queue"};
  RunnerLock lock_;
  int wakeups_ = 0;
  CommandQueue queue_{lock_, [this] { ++wakeups_; }};
  std::string ran_;
};

TEST_F(CommandQueueTest, RunsPostedCommandsInOrder) {
  queue_.postLater(note('a'));
  queue_.post(note('b'));
  EXPECT_EQ(wakeups_, 2);
  EXPECT_TRUE(queue_.hasCommands());
  EXPECT_EQ(ran_, "");

  queue_.run();

  EXPECT_EQ(ran_, "ab");
  EXPECT_FALSE(queue_.hasCommands());
}

TEST_F(CommandQueueTest, TheRunnerRunsItsOwnCommandsNow) {
  lock_.acquire([] {});
  const RunnerGuard guard(&lock_);

  queue_.post(note('a'));
  queue_.runOrPost(note('b'));
  queue_.runOrWait(note('c'), false);
  queue_.postLater(note('d'));

  EXPECT_EQ(ran_, "abc");
}

TEST_F(CommandQueueTest, RunOrPostRunsACommandNowWhenNoThreadRunsTheDispatcher) {
  queue_.runOrPost(note('a'));
  queue_.runOrWait(note('b'), false);

  EXPECT_EQ(ran_, "ab");
  EXPECT_FALSE(queue_.hasCommands());
  EXPECT_FALSE(lock_.isMine());
}

TEST_F(CommandQueueTest, RunOrPostPostsACommandWhenAnotherThreadRunsTheDispatcher) {
  besideARunner([&] { queue_.runOrPost(note('a')); });
  EXPECT_EQ(ran_, "");

  queue_.run();

  EXPECT_EQ(ran_, "a");
}

TEST_F(CommandQueueTest, ACommandThatIsPostedByACommandRunsInTheNextStep) {
  queue_.postLater([this] { queue_.postLater(note('b')); });

  queue_.run();
  EXPECT_EQ(ran_, "");
  queue_.run();

  EXPECT_EQ(ran_, "b");
}

TEST_F(CommandQueueTest, ACommandThatThrowsLeavesTheOthersPosted) {
  queue_.postLater([] { throw std::runtime_error("a callback"); });
  queue_.postLater(note('b'));

  EXPECT_THROW(queue_.run(), std::runtime_error);
  queue_.run();

  EXPECT_EQ(ran_, "b");
}

// Each of the two threads may run the command; it runs once.
TEST_F(CommandQueueTest, AWaitingThreadRunsItsCommandWhenTheRunnerStops) {
  lock_.acquire([] {});
  std::thread waiting([this] { queue_.runOrWait(note('a'), false); });
  while (!queue_.hasWaiting()) std::this_thread::yield();

  lock_.release();
  waiting.join();
  EXPECT_EQ(ran_, "a");
  queue_.runWaiting();

  EXPECT_EQ(ran_, "a");
}

TEST_F(CommandQueueTest, AWaitingThreadReturnsWhenTheRunnerHasRunItsCommand) {
  lock_.acquire([] {});
  const RunnerGuard guard(&lock_);
  std::thread waiting([this] { queue_.runOrWait(note('a'), true); });
  while (!queue_.hasWaiting()) std::this_thread::yield();

  queue_.run();
  EXPECT_EQ(ran_, "");
  queue_.runWaiting();
  waiting.join();

  EXPECT_EQ(ran_, "a");
}

TEST_F(CommandQueueTest, ManyThreadsMayWait) {
  constexpr int kThreads = 5;
  std::vector<std::thread> threads;
  {
    lock_.acquire([] {});
    const RunnerGuard guard(&lock_);
    for (int i = 0; i < kThreads; ++i)
      threads.emplace_back([this] { queue_.runOrWait(note('a'), false); });
    while (ran_.empty()) queue_.runWaiting();
  }

  for (auto& thread : threads) thread.join();

  EXPECT_EQ(ran_, std::string(kThreads, 'a'));
  EXPECT_FALSE(queue_.hasWaiting());
}

TEST_F(CommandQueueTest, TryRunRunsNothingBesideARunner) {
  besideARunner([&] { EXPECT_FALSE(queue_.tryRun(note('a'))); });
  EXPECT_EQ(ran_, "");

  EXPECT_TRUE(queue_.tryRun(note('b')));

  EXPECT_EQ(ran_, "b");
}

}  // namespace
}  // namespace mpf::test
