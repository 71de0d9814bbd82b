// SPDX-License-Identifier: MIT
// NudgeInterval: when a client rings its server's doorbell again, because a hint may have been
// lost: after 50 ms, then after times that double up to 1 s.
//
// Threads  one.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mpf {

class NudgeInterval {
 public:
  static constexpr std::int64_t kFirstNs = 50'000'000;
  static constexpr std::int64_t kLastNs = 1'000'000'000;

  // The server's doorbell was rung at `nowNs`.
  void start(std::int64_t nowNs) noexcept {
    rungNs_ = nowNs;
    intervalNs_ = kFirstNs;
  }
  // The next series begins with the shortest interval.
  void reset() noexcept { intervalNs_ = kFirstNs; }
  // Returns true when the doorbell is to be rung now.
  [[nodiscard]] bool tryTake(std::int64_t nowNs) noexcept {
    if (nowNs < dueNs()) return false;
    rungNs_ = nowNs;
    intervalNs_ = std::min(2 * intervalNs_, kLastNs);
    return true;
  }
  [[nodiscard]] std::int64_t dueNs() const noexcept { return rungNs_ + intervalNs_; }

 private:
  std::int64_t rungNs_ = 0;
  std::int64_t intervalNs_ = kFirstNs;
};

}  // namespace mpf
