// SPDX-License-Identifier: MIT
#include "base/biased_lock.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include "tests/support/replaced_yield.h"

namespace mpf {
namespace {

constexpr int kManyEntries = 100'000;
constexpr int kSomeYields = 10;

// Threads take turns at being the only user, and then all use the lock at once.
TEST(BiasedLockTest, AdmitsOneThreadAtATime) {
  BiasedLock lock;
  int count = 0;  // not atomic: the lock protects it
  const auto work = [&](int times) {
    for (int i = 0; i < times; ++i) {
      const BiasedLock::Guard guard(lock);
      ++count;
    }
  };

  work(kManyEntries);
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back(work, kManyEntries);
  work(kManyEntries);
  for (auto& thread : threads) thread.join();
  work(kManyEntries);

  EXPECT_EQ(count, 6 * kManyEntries);
}

// The owner of the bias holds the lock without a locked instruction; another thread waits for it.
TEST(BiasedLockTest, AnotherThreadWaitsForTheOwner) {
  BiasedLock lock;
  for (int i = 0; i < kManyEntries; ++i) {
    const BiasedLock::Guard guard(lock);
  }
  bool isHeld = true;
  std::atomic<int> yields{0};  // of the other thread
  std::atomic<bool> hasEntered{false};
  std::thread other;
  {
    const BiasedLock::Guard guard(lock);
    other = std::thread([&] {
      const test::ReplacedYield counted([&] {
        ++yields;
        ::syscall(SYS_sched_yield);
      });
      const BiasedLock::Guard mine(lock);
      hasEntered = true;
      EXPECT_FALSE(isHeld);
    });

    while (yields < kSomeYields && !hasEntered) std::this_thread::yield();

    EXPECT_FALSE(hasEntered);
    isHeld = false;
  }
  other.join();
  EXPECT_TRUE(hasEntered);
}

}  // namespace
}  // namespace mpf
