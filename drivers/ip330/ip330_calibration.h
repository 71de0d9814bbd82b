// SPDX-License-Identifier: MIT
// Ip330Calibration: from what the converter gives for two voltages that the board has itself, what its codes should have been.
//
//   corrected = slope * (raw + offset), of which 0 to 65535 are the range's ends; a perfect converter has slope 1, offset 0
//
// Range 0to5 at gain code 3 (8): the lowest voltage of the board but 0 V is nearly the end of the range, so 0 V must serve. A converter whose
// offset is below 0 gives code 0 for it, whatever the offset is: nothing on such a board tells, and this gain is refused.
//
// Source   IP330 manual, "Calibration"; which two voltages serve for which range and gain.
#pragma once

#include <cstdint>
#include <optional>

#include <mpf/drivers/ip330/ip330_settings.h>

namespace mpf {

struct Ip330CalibrationPoint {
  double volts;
  std::uint16_t source;  // bits of the control register
};

struct Ip330CalibrationPoints {
  Ip330CalibrationPoint low, high;
};

[[nodiscard]] Ip330CalibrationPoints calibrationPointsOf(Ip330Range range, int gain) noexcept;

struct Ip330Correction {
  double slope = 1;
  double offset = 0;

  [[nodiscard]] double apply(double raw) const noexcept { return slope * (raw + offset); }
};

// From the means of both points' codes; nullopt when no converter gives such codes: it is dead or absent; or when one is at an end of the range,
// where nobody knows how far beyond it is, and noise is cut off on one side.
[[nodiscard]] std::optional<Ip330Correction> correctionOf(Ip330Range range, int gain, double lowCode, double highCode) noexcept;

// The code that a client gets: rounded, and within 0 to 0xffff.
[[nodiscard]] int clampedCode(double corrected) noexcept;

}  // namespace mpf
