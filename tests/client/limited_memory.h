// SPDX-License-Identifier: MIT
// Operator new of the program of this file fails when a thread may allocate no more.
#pragma once

#include <atomic>

namespace mpf::test {

inline constexpr int kUnlimited = -1;
inline thread_local int allocationsLeft = kUnlimited;  // of this thread
inline std::atomic<int> failedAllocations{0};  // of all threads
inline std::atomic<bool> isMemoryLimited{true};  // false: no allocation fails

// Limits the allocations of this thread in its scope.
class LimitedMemory {
 public:
  explicit LimitedMemory(int allocations) {
    allocationsLeft = allocations;
    isMemoryLimited = true;
  }
  ~LimitedMemory() { allocationsLeft = kUnlimited; }
  LimitedMemory(const LimitedMemory&) = delete;
  LimitedMemory& operator=(const LimitedMemory&) = delete;
};

}  // namespace mpf::test
