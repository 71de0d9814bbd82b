// SPDX-License-Identifier: MIT
// ForkGuard: detects that a fork copied an object from the parent process. The child of a fork
// without exec gets copies of all of its parent's objects. These copies must do nothing: the child
// has none of their threads, and their segments belong to the parent.
//
//   fork() ─► child: closes its copies of the parent's locks, replaces the mappings by private
//             memory (fault_guard.h) ─► isInherited() of the copied objects is true
//
// Threads  any.
// Crash    peers see the parent's death although its child is alive, because the child holds none
//          of its locks.
// Trust    reads nothing from shared memory.
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
  // Throws std::logic_error if this object was made before a fork, in the parent process. `object`
  // names it in the message.
  void check(const char* object) const {
    if (isInherited()) throw std::logic_error(explain(object));
  }
  [[nodiscard]] static std::string explain(const char* object) {
    return std::string(object) +
           ": made before a fork, so it belongs to the parent process; make a new one in the child";
  }
  // Releases a std::thread whose thread does not exist in the child: neither join() nor detach()
  // would work.
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
  // Storage whose std::thread is never destroyed.
  static std::thread& abandoned() noexcept {
    alignas(std::thread) static std::byte place[sizeof(std::thread)];
    return *reinterpret_cast<std::thread*>(place);
  }
  std::uint32_t forks_;
};

}  // namespace mpf
