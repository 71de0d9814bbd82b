// SPDX-License-Identifier: MIT
#include "base/biased_lock.h"

#include <gtest/gtest.h>
#include <mutex>
#include <semaphore>
#include <thread>
#include <vector>

namespace mpf {
namespace {

constexpr int kManyEntries = 100'000;

// Threads take turns at being the only user, and then all use the lock at once.
TEST(BiasedLockTest, AdmitsOneThreadAtATime) {
  BiasedLock lock;
  int count = 0;  // not atomic: the lock protects it
  const auto work = [&](int times) {
    for (int i = 0; i < times; ++i) {
      const std::lock_guard guard(lock);
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
    const std::lock_guard guard(lock);
  }
  bool isHeld = true;
  std::binary_semaphore hasStarted{0};
  std::thread other;
  {
    const std::lock_guard guard(lock);
    other = std::thread([&] {
      hasStarted.release();
      const std::lock_guard mine(lock);
      EXPECT_FALSE(isHeld);
    });
    hasStarted.acquire();
    for (int i = 0; i < 1000; ++i) std::this_thread::yield();
    isHeld = false;
  }
  other.join();
}

}  // namespace
}  // namespace mpf
