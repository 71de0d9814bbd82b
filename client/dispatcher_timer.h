// SPDX-License-Identifier: MIT
// DispatcherTimer: the time at which a dispatcher must wake up to do what is due.
//
// Threads  any. A thread that lowers the time wakes the thread that waits, if it is another one.
//          takeLowered(): the dispatcher's thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include <mpf/clock.h>

#include "base/thread_number.h"
#include "shm/endpoint.h"

namespace mpf {

class Binding;

class DispatcherTimer {
 public:
  //   endpoint   the dispatcher waits in endpoint.wait(due())
  explicit DispatcherTimer(Endpoint& endpoint) noexcept : endpoint_(endpoint) {}

  [[nodiscard]] Deadline due() const noexcept {
    // PAIR(waiting-thread): read after the waiting thread has stored its id in waitingThread_.
    return Deadline::atNs(dueNs_.load(std::memory_order_seq_cst));
  }
  [[nodiscard]] bool isDue() const noexcept {
    return dueNs_.load(std::memory_order_relaxed) != INT64_MAX && due().hasPassed();
  }

  // Makes sure that the dispatcher wakes up at `ns`.
  void wakeAt(std::int64_t ns) noexcept {
    auto due = dueNs_.load(std::memory_order_relaxed);
    // PAIR(waiting-thread): stored before this thread reads which thread waits.
    while (ns < due && !dueNs_.compare_exchange_weak(due, ns, std::memory_order_seq_cst,
                                                     std::memory_order_relaxed)) {
    }
    // PAIR(waiting-thread): the waiting thread reads the time stored above, or its id is read here.
    if (ns < due && waitingThread_.load(std::memory_order_seq_cst) != threadNumber())
      endpoint_.interrupt();
  }

  // The time of this binding was lowered. Before wakeAt().
  void reportLowered(Binding* binding) noexcept try {
    const std::lock_guard guard(mutex_);
    lowered_.push_back(binding);
  } catch (const std::bad_alloc&) {
    const std::lock_guard guard(mutex_);
    hasLost_ = true;
  }
  // The bindings whose time was lowered since the last call; some of them may no longer exist.
  // nullopt: any may have been lowered, because there was no memory.
  [[nodiscard]] std::optional<std::vector<Binding*>> takeLowered() noexcept {
    const std::lock_guard guard(mutex_);
    auto lowered = std::exchange(lowered_, {});
    if (std::exchange(hasLost_, false)) return std::nullopt;
    return lowered;
  }

  // The calling thread waits until due() from now on.
  void setWaitingThread() noexcept {
    const auto me = threadNumber();
    // PAIR(waiting-thread): stored before this thread reads how long it may wait.
    if (waitingThread_.load(std::memory_order_relaxed) != me)
      waitingThread_.store(me, std::memory_order_seq_cst);
  }

  // Forgets the time: the caller handles all that is due before it.
  void reset() noexcept {
    dueNs_.store(INT64_MAX, std::memory_order_relaxed);
    // PAIR(due): the caller sees a time that a BindingTimer stored before this reset; one that is
    // stored later lowers dueNs_ again.
    doorbell::fence();
  }

 private:
  Endpoint& endpoint_;
  std::atomic<std::int64_t> dueNs_{INT64_MAX};
  // threadNumber() of the one that waits, or waited last
  std::atomic<std::uint64_t> waitingThread_{0};
  std::mutex mutex_;  // guards the members below
  std::vector<Binding*> lowered_;
  bool hasLost_ = false;
};

}  // namespace mpf
