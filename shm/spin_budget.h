// SPDX-License-Identifier: MIT
// SpinBudget: how long an endpoint with WaitMode::adaptive polls before it sleeps: about twice the
// duration of a wake-up, and half as long after each long sleep, until a sleep is short again.
//
// An endpoint that polls gives up its processor now and then. If others then use the processor for
// long, polling only delays them and this process: the next waits sleep at once.
//
// Threads  one owner thread.
// Trust    the durations of wake-ups come from peers: each counts as one millisecond at most.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mpf {

class SpinBudget {
 public:
  [[nodiscard]] std::int64_t ns() const noexcept { return (2 * wakeNs_) >> halvings_; }
  // Begins a wait. Returns for how long it may poll; 0: not at all.
  [[nodiscard]] std::int64_t take() noexcept {
    if (skips_ == 0) return ns();
    --skips_;
    return 0;
  }
  // A wait has given up its processor for this duration.
  void noteYield(std::int64_t ns) noexcept {
    if (ns < kLongYieldNs) {
      lastSkips_ -= std::min(lastSkips_, 1u);
    } else {
      skips_ = lastSkips_ = std::min(2 * lastSkips_ + kFirstSkips, kMaxSkips);
    }
  }
  // Updates the estimated duration of a wake-up with a measured one.
  void noteWake(std::int64_t ns) noexcept {
    wakeNs_ += (std::min<std::int64_t>(ns, 1'000'000) - wakeNs_) / 8;
  }
  // After a sleep of this duration.
  void noteSleep(std::int64_t ns) noexcept {
    halvings_ = ns < 4 * wakeNs_ ? 0 : std::min(halvings_ + 1, 5u);
  }

 private:
  static constexpr std::int64_t kLongYieldNs = 1'000'000;
  static constexpr std::uint32_t kFirstSkips = 8;
  static constexpr std::uint32_t kMaxSkips = 1024;

  std::int64_t wakeNs_ = 10'000;  // estimated duration of a wake-up
  std::uint32_t halvings_ = 0;
  std::uint32_t skips_ = 0;  // waits that will sleep at once
  std::uint32_t lastSkips_ = 0;  // after the last long yield
};

}  // namespace mpf
