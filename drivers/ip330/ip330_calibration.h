// SPDX-License-Identifier: MIT
// Ip330Calibration: corrects the codes of the converter, using its codes for two reference voltages
// of the board.
//
//   corrected = slope * (raw + offset)      0 to 65535 covers the range
//
// A perfect converter has slope 1 and offset 0.
//
// Range 0to5 at gain code 3 (a gain of 8): the lowest reference above 0 V is nearly at the end of
// the range, so 0 V must be the lower reference. A converter with a negative offset gives code 0
// for 0 V, whatever the offset is, so the offset cannot be measured and this gain is refused.
//
// Threads  any number of callers at a time.
// Source   IP330 manual, "Calibration", which gives the two voltages for each range and gain.
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/ip330/ip330_settings.h"

namespace mpf {

struct Ip330CalibrationPoint {
  double volts;
  std::uint16_t source;  // bits of the control register that select the voltage
};

struct Ip330CalibrationPoints {
  Ip330CalibrationPoint low, high;
};

// The reference voltages for a range and a gain code of 0 to 3.
[[nodiscard]] Ip330CalibrationPoints calibrationPointsOf(Ip330Range range, int gain) noexcept;

struct Ip330Correction {
  double slope = 1;
  double offset = 0;  // codes

  [[nodiscard]] double apply(double raw) const noexcept { return slope * (raw + offset); }
};

// Computes the correction from the mean codes of both reference voltages.
//   returns  nullopt when no working converter gives such codes, or when a mean is at an end of the
//            range: there the voltage may be beyond the range, and noise is clipped on one side
[[nodiscard]] std::optional<Ip330Correction> correctionOf(Ip330Range range, int gain,
                                                          double lowCode, double highCode) noexcept;

// The code that a client gets: rounded and clamped to 0 to 0xffff.
[[nodiscard]] int clampedCode(double corrected) noexcept;

}  // namespace mpf
