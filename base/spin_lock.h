// SPDX-License-Identifier: MIT
// SpinLock: a lock between threads of one process, held for a few tens of instructions. It must
// not be placed in shared memory: a killed holder would block the other processes forever.
#pragma once

#include <sched.h>

#include <atomic>

namespace mpf {

class SpinLock {
 public:
  void lock() noexcept {
    // PAIR(spin-lock): sees the writes of the previous holder.
    while (locked_.test_and_set(std::memory_order_acquire)) ::sched_yield();
  }
  void unlock() noexcept {
    // PAIR(spin-lock): publishes the writes made under the lock.
    locked_.clear(std::memory_order_release);
  }

 private:
  std::atomic_flag locked_;
};

}  // namespace mpf
