// SPDX-License-Identifier: MIT
#include "client/runner_lock.h"

#include <atomic>
#include <functional>
#include <gtest/gtest.h>
#include <latch>
#include <stdexcept>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

void inAnotherThread(const std::function<void()>& work) { std::thread(work).join(); }
void wakeNobody() {}

// A lock with a temporary owner, this thread, and a runner that waits for it.
class LockWithWaitingRunner {
 public:
  LockWithWaitingRunner() {
    EXPECT_TRUE(lock_.tryAcquireTemporarily());
    runner_ = std::thread([this] {
      lock_.acquire([this] {
        isWaiting_.count_down();
        mayTake_.wait();
      });
      EXPECT_TRUE(lock_.isMine());
      lock_.release();
    });
    isWaiting_.wait();
  }
  RunnerLock& lock() { return lock_; }
  // Lets the runner take the lock, which this thread has released. Returns when it has run.
  void letRun() {
    mayTake_.count_down();
    runner_.join();
  }

 private:
  const Watchdog watchdog_{"runner lock"};
  RunnerLock lock_;
  std::latch isWaiting_{1};
  std::latch mayTake_{1};
  std::thread runner_;
};

TEST(RunnerLock, BelongsToOneThread) {
  RunnerLock lock;
  EXPECT_FALSE(lock.isMine());

  lock.acquire(wakeNobody);

  EXPECT_TRUE(lock.isMine());
  inAnotherThread([&] { EXPECT_FALSE(lock.isMine()); });
  lock.release();
  EXPECT_FALSE(lock.isMine());
}

TEST(RunnerLock, RefusesASecondRunner) {
  RunnerLock lock;
  lock.acquire(wakeNobody);

  inAnotherThread([&] {
    EXPECT_THROW(lock.acquire(wakeNobody), std::logic_error);
    EXPECT_FALSE(lock.tryAcquireTemporarily());
  });

  lock.release();
}

// The thread that has been the runner for a while enters without a locked instruction.
class LockOfALoneRunner {
 public:
  LockOfALoneRunner() {
    for (int i = 0; i < 10'000; ++i) {
      lock_.acquire(wakeNobody);
      lock_.release();
    }
  }
  RunnerLock& lock() { return lock_; }

 private:
  RunnerLock lock_;
};

TEST(RunnerLock, RefusesASecondRunnerBesideALoneOne) {
  LockOfALoneRunner alone;
  auto& lock = alone.lock();
  lock.acquire(wakeNobody);
  EXPECT_TRUE(lock.isMine());

  inAnotherThread([&] {
    EXPECT_FALSE(lock.isMine());
    for (int tries = 0; tries < 3; ++tries) {
      EXPECT_THROW(lock.acquire(wakeNobody), std::logic_error);
      EXPECT_FALSE(lock.tryAcquireTemporarily());
    }
  });

  EXPECT_TRUE(lock.isMine());
  lock.release();
  EXPECT_FALSE(lock.isMine());
  lock.acquire(wakeNobody);
  EXPECT_TRUE(lock.isMine());
  lock.release();
}

TEST(RunnerLock, AnotherThreadMayRunAfterALoneRunner) {
  LockOfALoneRunner alone;
  auto& lock = alone.lock();

  inAnotherThread([&] {
    lock.acquire(wakeNobody);
    EXPECT_TRUE(lock.isMine());
    lock.release();
    EXPECT_TRUE(lock.tryAcquireTemporarily());
    lock.release();
  });

  EXPECT_TRUE(lock.tryAcquireTemporarily());
  lock.release();
}

// Two threads become alone runners, lose this right to each other, and are refused, all the time.
TEST(RunnerLock, ThreadsThatCompeteNeverRunTogetherAndNeverHang) {
  const Watchdog watchdog("runner lock");
  RunnerLock lock;
  std::atomic<int> running{0};
  std::atomic<bool> isOver{false};
  const auto run = [&](int times) {
    for (int i = 0; i < times; ++i) {
      lock.acquire(wakeNobody);
      EXPECT_EQ(++running, 1);
      EXPECT_TRUE(lock.isMine());
      --running;
      lock.release();
    }
  };
  std::atomic<int> refused{0};
  const auto compete = [&] {
    while (!isOver) {
      try {
        run(1000);
      } catch (const std::logic_error&) {
        ++refused;
      }
      if (lock.tryAcquireTemporarily()) {
        EXPECT_EQ(++running, 1);
        --running;
        lock.release();
      }
    }
  };
  std::thread first(compete);
  std::thread second(compete);
  while (refused < 100) std::this_thread::yield();
  isOver = true;
  first.join();
  second.join();
}

TEST(RunnerLock, ARunnerWaitsForATemporaryOwner) {
  LockWithWaitingRunner waiting;

  EXPECT_TRUE(waiting.lock().isRunnerWaiting());
  waiting.lock().release();
  waiting.letRun();
  EXPECT_FALSE(waiting.lock().isRunnerWaiting());
}

TEST(RunnerLock, AWaitingRunnerComesBeforeTemporaryOwners) {
  LockWithWaitingRunner waiting;

  waiting.lock().release();
  const bool isTaken = waiting.lock().tryAcquireTemporarily();

  EXPECT_FALSE(isTaken);
  if (isTaken) waiting.lock().release();
  waiting.letRun();
}

TEST(RunnerLock, TellsWhetherTheLastRunnerIsAnotherLivingThread) {
  const Watchdog watchdog("runner lock");
  RunnerLock lock;
  EXPECT_FALSE(lock.hasOtherRunner());
  std::latch hasRun(1);
  std::latch mayEnd(1);
  std::thread runner([&] {
    lock.acquire(wakeNobody);
    lock.release();
    EXPECT_FALSE(lock.hasOtherRunner());
    hasRun.count_down();
    mayEnd.wait();
  });

  hasRun.wait();
  EXPECT_TRUE(lock.hasOtherRunner());
  mayEnd.count_down();
  runner.join();

  EXPECT_FALSE(lock.hasOtherRunner());
}

TEST(RunnerLock, ATemporaryOwnerIsNoRunner) {
  RunnerLock lock;
  inAnotherThread([&] {
    ASSERT_TRUE(lock.tryAcquireTemporarily());
    const RunnerGuard guard(&lock);
  });

  EXPECT_FALSE(lock.hasOtherRunner());
  EXPECT_TRUE(lock.tryAcquireTemporarily());
  lock.release();
}

}  // namespace
}  // namespace mpf::test
