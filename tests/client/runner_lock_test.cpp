// SPDX-License-Identifier: MIT
#include "client/runner_lock.h"

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

TEST(RunnerLock, ARunnerWaitsForATemporaryOwner) {
  const Watchdog watchdog("runner lock");
  RunnerLock lock;
  ASSERT_TRUE(lock.tryAcquireTemporarily());
  std::latch woken(1);

  std::thread runner([&] {
    lock.acquire([&] { woken.count_down(); });
    EXPECT_TRUE(lock.isMine());
    lock.release();
  });
  woken.wait();

  EXPECT_TRUE(lock.isRunnerWaiting());
  lock.release();
  runner.join();
  EXPECT_FALSE(lock.isRunnerWaiting());
}

TEST(RunnerLock, AWaitingRunnerComesBeforeTemporaryOwners) {
  const Watchdog watchdog("runner lock");
  RunnerLock lock;
  ASSERT_TRUE(lock.tryAcquireTemporarily());
  std::latch woken(1);
  std::latch mayTake(1);
  std::thread runner([&] {
    lock.acquire([&] {
      woken.count_down();
      mayTake.wait();
    });
    lock.release();
  });
  woken.wait();

  lock.release();
  const bool isTaken = lock.tryAcquireTemporarily();

  EXPECT_FALSE(isTaken);
  if (isTaken) lock.release();
  mayTake.count_down();
  runner.join();
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
