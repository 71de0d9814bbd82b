// SPDX-License-Identifier: MIT
// SpinLock: a lock between threads of one process, held for a few tens of instructions. It must
// not be placed in shared memory: a killed holder would block the other processes forever.
#pragma once

#include <sched.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace mpf {

class SpinLock {
 public:
  void lock() noexcept {
    // PAIR(spin-lock): sees the writes of the previous holder.
    waitUntil([this] { return !locked_.test_and_set(std::memory_order_acquire); });
  }
  void unlock() noexcept {
    // PAIR(spin-lock): publishes the writes made under the lock.
    locked_.clear(std::memory_order_release);
  }

  // A waiting thread that only yields would keep its processor from a holder of lower real-time
  // priority, such as a scan thread of an IOC from another one, and so wait forever. It sleeps
  // after a few attempts.
  template <class IsTrue>
  static void waitUntil(const IsTrue& isTrue) noexcept {
    constexpr int kYields = 20;
    for (int attempts = 0; !isTrue(); ++attempts) {
      if (attempts < kYields) ::sched_yield();
      else std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
  }

 private:
  std::atomic_flag locked_;
};

}  // namespace mpf
