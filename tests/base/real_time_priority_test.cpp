// SPDX-License-Identifier: MIT
// RealTimePriority and InheritingMutex. Most tests need the permission for real-time priority, and
// are skipped without it.
#include <mpf/real_time_priority.h>

#include <sched.h>

#include <gtest/gtest.h>
#include <mutex>
#include <thread>

#include "base/inheriting_mutex.h"

namespace mpf {
namespace {

constexpr int kPriority = 1;

int policyOfThisThread() { return ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK; }

class RealTimePriorityTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!RealTimePriority::isAllowed(kPriority))
      GTEST_SKIP() << "this user may not have real-time priority";
  }
};

TEST_F(RealTimePriorityTest, AppliesOnlyToTheThreadItself) {
  std::thread([] {
    const RealTimePriority priority(kPriority);
    EXPECT_TRUE(priority.isHeld());
    EXPECT_EQ(policyOfThisThread(), SCHED_FIFO);
    std::thread([] {
      EXPECT_EQ(policyOfThisThread(), SCHED_OTHER) << "threads that it starts do not inherit it";
    }).join();
  }).join();

  EXPECT_EQ(policyOfThisThread(), SCHED_OTHER);
}

TEST(RealTimePriority, ZeroNeedsNoPermissionAndChangesNothing) {
  std::thread([] {
    RealTimePriority priority(0);
    priority.check();
    EXPECT_FALSE(priority.isHeld());
    EXPECT_EQ(policyOfThisThread(), SCHED_OTHER);
  }).join();
}

// Otherwise this thread would starve all other threads.
TEST_F(RealTimePriorityTest, IsRemovedFromAThreadThatNeverSleepsAndRestored) {
  std::thread([] {
    RealTimePriority priority(kPriority);
    while (priority.isHeld()) priority.check();
    EXPECT_EQ(policyOfThisThread(), SCHED_OTHER);

    while (!priority.isHeld()) priority.check();
    EXPECT_EQ(policyOfThisThread(), SCHED_FIFO);
  }).join();
}

TEST(InheritingMutexTest, AdmitsOneThreadAtATime) {
  InheritingMutex mutex;
  int count = 0;
  const auto work = [&] {
    for (int i = 0; i < 10'000; ++i) {
      const std::lock_guard lock(mutex);
      ++count;
    }
  };
  std::thread other(work);
  work();
  other.join();

  EXPECT_EQ(count, 20'000);
  const std::lock_guard lock(mutex);
  std::thread([&] { EXPECT_FALSE(mutex.try_lock()); }).join();
}

}  // namespace
}  // namespace mpf
