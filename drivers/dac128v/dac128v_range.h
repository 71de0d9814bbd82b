// SPDX-License-Identifier: MIT
// Dac128vRange: what a group of four channels gives, as its jumpers say; codes and volts.
//
// Source  Systran DAC128V: each group of four has a lower and an upper reference out of -10, -5, 0, +5 and +10 V. A step is 1/4096 of
//         the span, so the highest code stays a step below the upper reference, and code 2048 is the middle.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace mpf {

struct Dac128vRange {
  double low = -10;  // volts
  double high = 10;

  static constexpr int kCodes = 4096;

  [[nodiscard]] constexpr double voltsOf(int code) const noexcept { return low + (high - low) * code / kCodes; }
  // The nearest code; empty when the channel cannot give that, by more than half a step.
  [[nodiscard]] std::optional<int> tryCodeOf(double volts) const noexcept;

  friend bool operator==(const Dac128vRange&, const Dac128vRange&) = default;
};

// Of channels 0 to 3 and 4 to 7.
using Dac128vRanges = std::array<Dac128vRange, 2>;

// "-10to10"; or two, "-10to10,0to5", one for each group.
//   throws  std::invalid_argument that says what there is
[[nodiscard]] Dac128vRanges parseDac128vRanges(const std::string& text);

}  // namespace mpf
