// SPDX-License-Identifier: MIT
// SharedProcessor: decides whether a wait polls, and whether it yields the processor while it
// polls. Another thread on this processor may be the peer, or the router on the way to it.
//
//   yield   polls, and calls sched_yield() at each look at the clock
//   keep    polls without yielding: a yield lasted a millisecond or more, so another program uses
//           the processor, and a message could arrive during its time slice
//   sleep   sleeps at once: the last yields let other threads run briefly, and no event followed;
//           a wake-up costs less than switching to these threads and back
//
// Threads  one owner thread.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mpf {

class SharedProcessor {
 public:
  enum class Plan { yield, keep, sleep };
  // Returns the plan of the next wait. Call it once for each wait.
  [[nodiscard]] Plan plan() noexcept {
    if (keeps_ != 0) {
      --keeps_;
      return Plan::keep;
    }
    const bool isUseless = emptyYields_ == kMaxEmptyYields;
    return isUseless && ++uselessWaits_ % kYieldEvery != 0 ? Plan::sleep : Plan::yield;
  }
  // Whether a yield of this duration shows that another program uses the processor.
  [[nodiscard]] static bool isLong(std::int64_t ns) noexcept { return ns >= kLongYieldNs; }
  // Records a yield of this duration. `hasEvents`: there was an event after it.
  void noteYield(std::int64_t ns, bool hasEvents) noexcept {
    if (hasEvents || ns < kOthersRanNs) emptyYields_ = 0;
    else if (ns < kStreamNs) emptyYields_ = std::min(emptyYields_ + 1, kMaxEmptyYields);
    if (!isLong(ns)) {
      lastKeeps_ -= (lastKeeps_ + kForgetting - 1) / kForgetting;
    } else {
      keeps_ = lastKeeps_ = std::min(2 * lastKeeps_ + kFirstKeeps, kMaxKeeps);
    }
  }
  // A wait has found an event without a yield: polling is useful, usually because the sender runs
  // on another processor.
  void notePolled() noexcept { emptyYields_ = 0; }

 private:
  // A yield takes 0.8 us if no other thread runs, and 4 us with two context switches.
  static constexpr std::int64_t kOthersRanNs = 1500;
  // A longer yield does not count: the router is handling a stream, so the next message comes soon.
  static constexpr std::int64_t kStreamNs = 40'000;
  static constexpr std::uint32_t kMaxEmptyYields = 4;
  static constexpr std::uint32_t kYieldEvery = 64;
  static constexpr std::int64_t kLongYieldNs = 1'000'000;
  static constexpr std::uint32_t kFirstKeeps = 8;
  static constexpr std::uint32_t kMaxKeeps = 1u << 14;
  static constexpr std::uint32_t kForgetting = 64;

  std::uint32_t keeps_ = 0;  // waits that will keep the processor
  std::uint32_t lastKeeps_ = 0;  // after the last long yield
  std::uint32_t emptyYields_ = 0;  // brief ones without an event, in succession
  std::uint32_t uselessWaits_ = 0;  // each kYieldEvery-th of them yields
};

}  // namespace mpf
