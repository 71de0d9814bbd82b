// SPDX-License-Identifier: MIT
// SpinLock: a lock between threads of one process around some tens of instructions. Never in shared
// memory.
#pragma once

#include <sched.h>

#include <atomic>

namespace mpf {

class SpinLock {
 public:
  void lock() noexcept {
    // PAIR(spin-lock): what the last holder did.
    while (locked_.test_and_set(std::memory_order_acquire)) ::sched_yield();
  }
  void unlock() noexcept {
    // PAIR(spin-lock): what was done under the lock.
    locked_.clear(std::memory_order_release);
  }

 private:
  std::atomic_flag locked_;
};

}  // namespace mpf
