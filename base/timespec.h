// SPDX-License-Identifier: MIT
// timespecOf: nanoseconds as the seconds and nanoseconds that system calls expect.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

namespace mpf {

// A duration, or a time of the clock that the call uses. `ns` must not be negative.
[[nodiscard]] constexpr timespec timespecOf(std::int64_t ns) noexcept {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return {.tv_sec = static_cast<time_t>(ns / kNsPerSecond),
          .tv_nsec = static_cast<long>(ns % kNsPerSecond)};
}

[[nodiscard]] constexpr timespec timespecOf(std::chrono::nanoseconds time) noexcept {
  return timespecOf(std::int64_t{time.count()});
}

}  // namespace mpf
