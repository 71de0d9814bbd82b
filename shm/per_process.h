// SPDX-License-Identifier: MIT
// PerProcess: an object of which each process has its own: after a fork, the child gets a new one.
// The child must not use or destroy its copy of the parent's object: a thread that does not exist
// in the child may have locked it, or may have been changing it.
//
// Threads  any.
#pragma once

#include <atomic>
#include <memory>

#include "shm/fork_guard.h"

namespace mpf {

template <class T>
class PerProcess {
 public:
  PerProcess() = default;
  ~PerProcess() {
    auto* const last = last_.load(std::memory_order_relaxed);
    if (last != nullptr && !last->forkGuard.isInherited()) delete last;
  }
  PerProcess(const PerProcess&) = delete;
  PerProcess& operator=(const PerProcess&) = delete;

  // The object of this process; the first call creates it from `args`.
  //   throws  as the constructor of T
  template <class... Args>
  T& get(const Args&... args) {
    // PAIR(per-process): the object is complete.
    auto* last = last_.load(std::memory_order_acquire);
    if (last == nullptr || last->forkGuard.isInherited()) {
      auto made = std::make_unique<Entry>(last, args...);
      // PAIR(per-process): as above, of another thread; the object is complete.
      if (last_.compare_exchange_strong(last, made.get(), std::memory_order_acq_rel,
                                        std::memory_order_acquire))
        last = made.release();
    }
    return last->object;
  }

 private:
  struct Entry {
    template <class... Args>
    explicit Entry(const Entry* parents, const Args&... args)
        : inherited(parents), object(args...) {}

    const Entry* inherited;  // of the parent process: not destroyed
    ForkGuard forkGuard;
    T object;
  };

  std::atomic<Entry*> last_{nullptr};
};

}  // namespace mpf
