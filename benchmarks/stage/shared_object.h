// SPDX-License-Identifier: MIT
// SharedObject: an object in memory that this process shares with the processes that it forks.
//
// Threads  any; the members of T say who writes them.
// Crash    the memory is anonymous: nothing remains.
#pragma once

#include <sys/mman.h>

#include <cerrno>
#include <new>
#include <type_traits>

#include "base/system_call.h"

namespace mpf::bench {

template <class T>
class SharedObject {
 public:
  static_assert(std::is_trivially_destructible_v<T>);

  SharedObject()
      : memory_(
            ::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    if (memory_ == MAP_FAILED) throwSystemError(errno, "mmap", "memory shared by a measurement");
    new (memory_) T;
  }
  ~SharedObject() { ::munmap(memory_, sizeof(T)); }
  SharedObject(const SharedObject&) = delete;
  SharedObject& operator=(const SharedObject&) = delete;

  [[nodiscard]] T& operator*() const noexcept { return *static_cast<T*>(memory_); }
  [[nodiscard]] T* operator->() const noexcept { return static_cast<T*>(memory_); }

 private:
  void* memory_;
};

}  // namespace mpf::bench
