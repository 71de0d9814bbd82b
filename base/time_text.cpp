// SPDX-License-Identifier: MIT
#include "base/time_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>

#include "base/number.h"

namespace mpf {
namespace {

struct Unit {
  std::string_view name;
  Nanoseconds size;
};
constexpr std::array<Unit, 3> kUnits{{{"min", std::chrono::minutes(1)},
                                      {"s", std::chrono::seconds(1)},
                                      {"ms", std::chrono::milliseconds(1)}}};

}  // namespace

std::optional<Nanoseconds> tryTime(std::string_view text, MissingUnit missing) {
  const auto number = tryTakeNumber<double>(text);
  if (text.empty() && missing == MissingUnit::seconds) text = "s";
  const auto* const unit = std::ranges::find(kUnits, text, &Unit::name);
  if (!number || unit == kUnits.end()) return std::nullopt;
  const auto ns = *number * static_cast<double>(unit->size.count());
  const bool isValid = ns >= 0 && ns <= static_cast<double>(kLongestTime.count());  // NaN is not
  return isValid ? std::optional(Nanoseconds(std::llround(ns))) : std::nullopt;
}

std::string timeText(Nanoseconds time) {
  if (time == Nanoseconds(0)) return "0s";
  const auto* const unit = std::ranges::find_if(
      kUnits, [&](const Unit& one) { return time % one.size == Nanoseconds(0); });
  if (unit != kUnits.end()) return fmt::format("{}{}", time / unit->size, unit->name);
  return fmt::format("{}ms", static_cast<double>(time.count()) / 1e6);
}

}  // namespace mpf
