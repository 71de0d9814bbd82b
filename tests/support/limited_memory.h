// SPDX-License-Identifier: MIT
// LimitedMemory: lets allocations of one thread fail, after a number that succeed.
//
//   const LimitedMemory limited(3);  // from here on, the fourth operator new throws std::bad_alloc
//
// An executable that uses it has another operator new: limited_memory.cpp.
//
// Threads  each thread has its own limit.
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
  // Not inline: a program that uses this class must get the operator new of this library, also
  // where the run-time library of a sanitizer has one.
  explicit LimitedMemory(int allocations) noexcept;
  ~LimitedMemory();
  LimitedMemory(const LimitedMemory&) = delete;
  LimitedMemory& operator=(const LimitedMemory&) = delete;
};

}  // namespace mpf::test
