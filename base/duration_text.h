// SPDX-License-Identifier: MIT
// durationText(): a duration as text for people: "87.3 ns", "4120 ns", "26.0 us", "1.5 s",
// "3 h 12 min".
#pragma once

#include <fmt/format.h>
#include <string>

namespace mpf {

// Returns three or four digits with a unit, in ASCII; whole units from 100 seconds on.
[[nodiscard]] inline std::string durationText(double ns) {
  if (ns < 100) return fmt::format("{:.1f} ns", ns);
  if (ns < 10'000) return fmt::format("{:.0f} ns", ns);
  if (ns < 10e6) return fmt::format("{:.1f} us", ns / 1e3);
  if (ns < 1e9) return fmt::format("{:.1f} ms", ns / 1e6);
  if (ns < 100e9) return fmt::format("{:.1f} s", ns / 1e9);
  const auto seconds = static_cast<long>(ns / 1e9);
  if (seconds < 120) return fmt::format("{} s", seconds);
  if (seconds < 7200) return fmt::format("{} min", seconds / 60);
  if (seconds < 2 * 86400L) return fmt::format("{} h {} min", seconds / 3600, seconds / 60 % 60);
  return fmt::format("{} d {} h", seconds / 86400, seconds / 3600 % 24);
}

}  // namespace mpf
