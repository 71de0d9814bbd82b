// SPDX-License-Identifier: MIT
#include <mpf/drivers/dac128v_range.h>

#include <cmath>
#include <stdexcept>
#include <string_view>

namespace mpf {
namespace {

struct Reference {
  std::string_view name;
  double volts;
};
constexpr std::array kReferences{Reference{"-10", -10}, Reference{"-5", -5}, Reference{"0", 0},
                                 Reference{"5", 5}, Reference{"10", 10}};

std::optional<double> tryReference(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  for (const auto& reference : kReferences) {
    if (reference.name == text) return reference.volts;
  }
  return std::nullopt;
}

Dac128vRange parseOne(const std::string& text) {
  const auto to = text.find("to");
  if (to != std::string::npos) {
    const auto low = tryReference(std::string_view(text).substr(0, to));
    const auto high = tryReference(std::string_view(text).substr(to + 2));
    if (low && high && *low < *high) return {*low, *high};
  }
  throw std::invalid_argument(
      "\"" + text +
      "\" is not an output range; use LOWtoHIGH with -10, -5, 0, 5 or 10 V, for example -10to10");
}

}  // namespace

std::optional<int> Dac128vRange::tryCodeOf(double volts) const noexcept {
  const auto code = std::round((volts - low) / (high - low) * kCodes);
  return code >= 0 && code < kCodes ? std::optional(static_cast<int>(code)) : std::nullopt;
}

Dac128vRanges parseDac128vRanges(const std::string& text) {
  const auto comma = text.find(',');
  const auto first = parseOne(text.substr(0, comma));
  return {first, comma == std::string::npos ? first : parseOne(text.substr(comma + 1))};
}

}  // namespace mpf
