// SPDX-License-Identifier: MIT
// BindingTimer: the time at which a binding has work to do. Its dispatcher wakes up by then.
//
// Threads  wakeAt() and dueNs(): any. The rest: the dispatcher's thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "client/dispatcher_timer.h"

namespace mpf {

class BindingTimer {
 public:
  //   owner   reported to the dispatcher when its time is lowered
  explicit BindingTimer(DispatcherTimer& dispatcher, Binding* owner = nullptr) noexcept
      : dispatcher_(dispatcher), owner_(owner) {}

  // INT64_MAX: nothing is due.
  [[nodiscard]] std::int64_t dueNs() const noexcept {
    return dueNs_.load(std::memory_order_relaxed);
  }
  void wakeAt(std::int64_t ns) noexcept {
    auto due = dueNs_.load(std::memory_order_relaxed);
    while (ns < due && !dueNs_.compare_exchange_weak(due, ns, std::memory_order_relaxed)) {
    }
    // PAIR(due): dueNs_ is stored before isReported_ and the dispatcher's dueNs_ are read.
    doorbell::fence();
    if (ns < due && !isReported_.exchange(true, std::memory_order_relaxed)) {
      dispatcher_.reportLowered(owner_);
      // Another thread may have lowered the time further and relied on this report, and the
      // dispatcher may have looked for reports before this one.
      ns = std::min(ns, dueNs());
    }
    dispatcher_.wakeAt(ns);
  }
  // The time, for a caller that reads it after a report of the dispatcher's timer.
  [[nodiscard]] std::int64_t takeReported() noexcept {
    isReported_.store(false, std::memory_order_relaxed);
    // PAIR(due): a sender that lowers dueNs_ from now on reports again.
    doorbell::fence();
    return dueNs();
  }
  // Forgets the time: the caller handles what is due.
  void reset() noexcept {
    dueNs_.store(INT64_MAX, std::memory_order_relaxed);
    // PAIR(due): a sender that lowers dueNs_ from now on wakes the dispatcher again.
    doorbell::fence();
  }

 private:
  DispatcherTimer& dispatcher_;
  Binding* owner_;
  std::atomic<std::int64_t> dueNs_{INT64_MAX};
  std::atomic<bool> isReported_{false};
};

}  // namespace mpf
