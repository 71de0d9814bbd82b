// SPDX-License-Identifier: MIT
// Dac128vRange: the output range of a group of four channels, as the jumpers set it; converts
// between codes and volts.
//
// Source  Systran DAC128V: each group of four channels has a lower and an upper reference of -10,
//         -5, 0, +5 or +10 V. A step is 1/4096 of the span, so the highest code is one step below
//         the upper reference, and code 2048 is the middle.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace mpf {

struct Dac128vRange {
  double low = -10;  // volts
  double high = 10;

  static constexpr int kCodes = 4096;

  // Returns the voltage [V] of a code of 0 to 4095.
  [[nodiscard]] constexpr double voltsOf(int code) const noexcept {
    return low + (high - low) * code / kCodes;
  }
  // Returns the nearest code; nullopt when `volts` is outside the range by more than half a step.
  [[nodiscard]] std::optional<int> tryCodeOf(double volts) const noexcept;

  friend bool operator==(const Dac128vRange&, const Dac128vRange&) = default;
};

// The ranges of channels 0 to 3 and of channels 4 to 7.
using Dac128vRanges = std::array<Dac128vRange, 2>;

// Reads "-10to10" for all channels, or "-10to10,0to5" with one range for each group.
//   throws  std::invalid_argument that names the invalid part and the valid values
[[nodiscard]] Dac128vRanges parseDac128vRanges(const std::string& text);

}  // namespace mpf
