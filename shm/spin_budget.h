// SPDX-License-Identifier: MIT
// SpinBudget: how long an endpoint with WaitMode::adaptive polls before it sleeps: about twice the
// duration of a wake-up, and half as long after each long sleep, until a sleep is short again.
//
// A wait that polls gives its processor up now and then: the peer, or the router on the way to it,
// may need it. If others then use the processor for long, they are not the peer: the next waits
// keep the processor while they poll, as a message may come within their time slice.
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
  // Begins a wait. Returns whether it gives its processor up.
  [[nodiscard]] bool takeYielding() noexcept {
    if (keeps_ == 0) return true;
    --keeps_;
    return false;
  }
  // A wait has given its processor up for this duration.
  void noteYield(std::int64_t ns) noexcept {
    if (ns < kLongYieldNs) {
      lastKeeps_ -= (lastKeeps_ + kForgetting - 1) / kForgetting;
    } else {
      keeps_ = lastKeeps_ = std::min(2 * lastKeeps_ + kFirstKeeps, kMaxKeeps);
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
  static constexpr std::uint32_t kFirstKeeps = 8;
  static constexpr std::uint32_t kMaxKeeps = 1u << 14;
  static constexpr std::uint32_t kForgetting = 64;

  std::int64_t wakeNs_ = 10'000;  // estimated duration of a wake-up
  std::uint32_t halvings_ = 0;
  std::uint32_t keeps_ = 0;  // waits that will keep the processor
  std::uint32_t lastKeeps_ = 0;  // after the last long yield
};

}  // namespace mpf
