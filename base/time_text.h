// SPDX-License-Identifier: MIT
// Times as configuration files and command lines have them: "200ms", "2s", "1.5min".
//
// Threads  any.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include <mpf/clock.h>

namespace mpf {

inline constexpr Nanoseconds kLongestTime = std::chrono::seconds(1'000'000'000);

// What a number without a unit means. Files require a unit; command lines do not.
enum class MissingUnit { invalid, seconds };

// Returns nullopt for text that is not a time from 0 to kLongestTime.
[[nodiscard]] std::optional<Nanoseconds> tryTime(std::string_view text,
                                                 MissingUnit missing = MissingUnit::invalid);

// The time in the form that tryTime() reads, with the largest unit that divides it.
[[nodiscard]] std::string timeText(Nanoseconds time);

}  // namespace mpf
