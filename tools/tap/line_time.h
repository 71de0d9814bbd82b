// SPDX-License-Identifier: MIT
// LineTime: the time at the beginning of a line of a sniffer: of day, and since the line before.
//
//   14:03:27.120       +0.8 ms
//
// Threads  one.
#pragma once

#include <cstdint>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <optional>
#include <string>

#include "base/saturating.h"

namespace mpf::tools {

class LineTime {
 public:
  //   realtimeOffsetNs  wall clock minus CLOCK_MONOTONIC
  explicit LineTime(std::int64_t realtimeOffsetNs) : offsetNs_(realtimeOffsetNs) {}

  //   atNs  CLOCK_MONOTONIC
  [[nodiscard]] std::string of(std::int64_t atNs) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    const auto wallNs = saturatingSum(atNs, offsetNs_);
    const auto sinceNs = lastNs_ ? saturatingDifference(atNs, *lastNs_) : 0;
    lastNs_ = atNs;
    return fmt::format("{:%H:%M:%S}.{:03} {:>+10.1f} ms",
                       fmt::localtime(static_cast<std::time_t>(wallNs / kSecond)),
                       wallNs % kSecond / 1'000'000, static_cast<double>(sinceNs) / 1e6);
  }

 private:
  std::int64_t offsetNs_;
  std::optional<std::int64_t> lastNs_;
};

}  // namespace mpf::tools
