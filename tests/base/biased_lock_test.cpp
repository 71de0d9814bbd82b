// SPDX-License-Identifier: MIT
#include "base/biased_lock.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include "base/expedited_barrier.h"
#include "tests/support/replaced_yield.h"

namespace mpf {
namespace {

constexpr int kManyEntries = 100'000;
constexpr int kSomeYields = 10;

// The bias is enabled for the calling thread.
void becomeOwner(BiasedLock& lock) {
  for (int i = 0; i < kManyEntries; ++i) {
    const BiasedLock::Guard guard(lock);
  }
}

// Whether ifBiased() calls its action.
bool isBiased(BiasedLock& lock) {
  bool isCalled = false;
  lock.ifBiased([&] { isCalled = true; });
  return isCalled;
}

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
  becomeOwner(lock);
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

TEST(BiasedLockTest, ActsUnderTheBiasOnlyInTheThreadThatHasIt) {
  if (!expedited_barrier::tryRegister()) GTEST_SKIP() << "the kernel has no expedited barrier";
  BiasedLock lock;
  EXPECT_FALSE(isBiased(lock)) << "before the first entry";
  becomeOwner(lock);

  std::thread([&] { EXPECT_FALSE(isBiased(lock)) << "in another thread"; }).join();

  EXPECT_TRUE(isBiased(lock)) << "the other thread has not disabled the bias";
  std::thread([&] { const BiasedLock::Guard guard(lock); }).join();
  EXPECT_FALSE(isBiased(lock)) << "the other thread has disabled the bias";
}

// The other thread enters by the real lock while the owner may be in its action.
TEST(BiasedLockTest, AnActionUnderTheBiasHoldsTheLock) {
  BiasedLock lock;
  becomeOwner(lock);
  int count = 0;  // not atomic: the lock protects it
  int actions = 0;
  std::atomic<bool> hasActed = false;
  std::thread other([&] {  // its first entry disables the bias
    while (!hasActed) std::this_thread::yield();
    for (int i = 0; i < kManyEntries; ++i) {
      const BiasedLock::Guard guard(lock);
      ++count;
    }
  });
  for (int i = 0; i < kManyEntries; ++i)
    lock.ifBiased([&] {
      ++count;
      ++actions;
      hasActed = true;
    });
  other.join();

  EXPECT_GT(actions, 0);
  EXPECT_EQ(count, kManyEntries + actions);
}

}  // namespace
}  // namespace mpf
