// SPDX-License-Identifier: MIT
// PollBudget: for how long a router polls after traffic, before it sleeps.
//
// A wait of at least kMaxNs quarters the time, a shorter one doubles it, up to kMaxNs. Unless
// two of three waits are short, the time stays near its minimum, as with single requests in long
// intervals.
//
// Threads  one.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mpf::router {

class PollBudget {
 public:
  // Longer than a hundred requests and their replies usually take on a local network, including
  // wake-ups.
  static constexpr std::int64_t kMaxNs = 200'000;

  [[nodiscard]] std::int64_t ns() const noexcept { return kMaxNs >> halvings_; }
  // The time between two bursts of traffic.
  void noteWait(std::int64_t ns) noexcept {
    halvings_ =
        ns < kMaxNs ? halvings_ - std::min(halvings_, 1u) : std::min(halvings_ + 2, kMaxHalvings);
  }

 private:
  static constexpr std::uint32_t kMaxHalvings = 6;

  std::uint32_t halvings_ = 0;
};

}  // namespace mpf::router
