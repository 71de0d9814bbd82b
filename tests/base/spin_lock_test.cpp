// SPDX-License-Identifier: MIT
#include "base/spin_lock.h"

#include <pthread.h>
#include <sched.h>

#include <gtest/gtest.h>
#include <mutex>
#include <semaphore>
#include <thread>

#include <mpf/real_time_priority.h>

namespace mpf {
namespace {

TEST(SpinLockTest, AdmitsOneThreadAtATime) {
  SpinLock lock;
  int count = 0;
  const auto work = [&] {
    for (int i = 0; i < 10'000; ++i) {
      const std::lock_guard guard(lock);
      ++count;
    }
  };
  std::thread other(work);
  work();
  other.join();

  EXPECT_EQ(count, 20'000);
}

// Restricts this thread to one processor.
void useOneProcessor() {
  cpu_set_t allowed;
  ASSERT_EQ(::sched_getaffinity(0, sizeof allowed, &allowed), 0);
  int first = 0;
  while (!CPU_ISSET(first, &allowed)) ++first;
  CPU_ZERO(&allowed);
  CPU_SET(first, &allowed);
  ASSERT_EQ(::sched_setaffinity(0, sizeof allowed, &allowed), 0);
}

TEST(SpinLockTest, AWaitingThreadOfHigherRealTimePriorityLetsTheHolderRun) {
  if (!RealTimePriority::isAllowed(2)) GTEST_SKIP() << "this user may not have real-time priority";
  SpinLock lock;
  std::binary_semaphore isLocked{0};
  std::thread waiting([&] {
    useOneProcessor();
    const RealTimePriority priority(2);
    isLocked.acquire();
    const std::lock_guard guard(lock);
  });
  std::thread holding([&] {
    useOneProcessor();
    const RealTimePriority priority(1);
    const std::lock_guard guard(lock);
    isLocked.release();  // the other thread gets the processor here
  });
  holding.join();
  waiting.join();
}

}  // namespace
}  // namespace mpf
