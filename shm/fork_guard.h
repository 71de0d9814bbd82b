// SPDX-License-Identifier: MIT
// ForkGuard: which process made an object. A child that forks without exec gets copies of its
// parent's objects that must do nothing: it has none of their threads, and what they share is the
// parent's.
//
//   fork() ─► in the child: the parent's locks are let go, its mappings become memory of the child's own ─► isInherited()
//
// Threads  any.
// Crash    the parent's death is seen although its child lives: the child holds none of its locks.
// Trust    nothing is read from shared memory.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace mpf {

class ForkGuard {
 public:
  ForkGuard() noexcept : forks_(forksUntilNow()) {}

  [[nodiscard]] bool isInherited() const noexcept {
    return forks_ != forks().load(std::memory_order_relaxed);
  }
  // Throws std::logic_error when `object` is not this process's own.
  void check(const char* object) const {
    if (isInherited()) throw std::logic_error(explain(object));
  }
  [[nodiscard]] static std::string explain(const char* object) {
    return std::string(object) +
           ": made before a fork, and still its parent's: a child makes its own";
  }
  // Of a thread that did not cross the fork: neither join nor detach would work.
  static void abandon(std::thread& thread) { new (&abandoned()) std::thread(std::move(thread)); }

 private:
  static std::uint32_t forksUntilNow() noexcept {
    [[maybe_unused]] static const int kWatched =
        ::pthread_atfork(nullptr, nullptr, [] { forks().fetch_add(1, std::memory_order_relaxed); });
    return forks().load(std::memory_order_relaxed);
  }
  static std::atomic<std::uint32_t>& forks() noexcept {
    static std::atomic<std::uint32_t> count{0};
    return count;
  }
  // Never destroyed.
  static std::thread& abandoned() noexcept {
    alignas(std::thread) static std::byte place[sizeof(std::thread)];
    return *reinterpret_cast<std::thread*>(place);
  }
  std::uint32_t forks_;
};

}  // namespace mpf
