// SPDX-License-Identifier: MIT
// SpinBudget: how long an endpoint with WaitMode::adaptive polls before it sleeps: about twice the
// duration of a wake-up, and half as long after each long sleep, until a sleep is short again.
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
  // Updates the estimated duration of a wake-up with a measured one.
  void noteWake(std::int64_t ns) noexcept {
    wakeNs_ += (std::min<std::int64_t>(ns, 1'000'000) - wakeNs_) / 8;
  }
  // After a sleep of this duration.
  void noteSleep(std::int64_t ns) noexcept {
    halvings_ = ns < 4 * wakeNs_ ? 0 : std::min(halvings_ + 1, 5u);
  }

 private:
  std::int64_t wakeNs_ = 10'000;  // estimated duration of a wake-up
  std::uint32_t halvings_ = 0;
};

}  // namespace mpf
