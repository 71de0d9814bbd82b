// SPDX-License-Identifier: MIT
// ReplyCounts: counts in the window of a server what its threads send.
//
// Threads  any.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/thread_number.h"
#include "shm/histogram.h"

namespace mpf {

class ReplyCounts {
 public:
  explicit ReplyCounts(layout::WindowControl& control) noexcept : control_(control) {}

  // Called by a thread before it takes requests. The first such thread becomes the only writer of
  // `sent`, without a locked instruction; all others add to `sentElsewhere`.
  void noteServerThread() noexcept {
    if (serverThread_.load(std::memory_order_relaxed) != kNoThread) return;
    auto none = kNoThread;
    serverThread_.compare_exchange_strong(none, threadNumber(), std::memory_order_relaxed);
  }
  void sent(std::uint64_t replies = 1) noexcept {
    if (serverThread_.load(std::memory_order_relaxed) == threadNumberOrZero())
      count(control_.sent, replies);
    else control_.sentElsewhere.fetch_add(replies, std::memory_order_relaxed);
  }
  void notSent() noexcept { control_.replyQueueFull.fetch_add(1, std::memory_order_relaxed); }
  // A request ended with the fate `refused`.
  void refused() noexcept { control_.refused.fetch_add(1, std::memory_order_relaxed); }
  // The time from taking a request to its first reply.
  void service(std::int64_t ns) noexcept { recordFromAnyThread(control_.serviceNs, ns); }

 private:
  layout::WindowControl& control_;
  std::atomic<std::uint64_t> serverThread_{kNoThread};  // its threadNumber()
};

}  // namespace mpf
