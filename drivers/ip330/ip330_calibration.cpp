// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/ip330/ip330_registers.h"

namespace mpf {
namespace {

constexpr double kCodes = 65536;
// The largest plausible difference of a slope from 1; the chip guarantees a much smaller one.
constexpr double kMostSlopeError = 0.2;
// The least distance of a mean from both ends of the range: noise of three codes that is clipped at
// an end then shifts the mean by less than 1.5 codes.
constexpr double kEndCodes = 1;

constexpr Ip330CalibrationPoint kZero{0, ip330::kSourceAutoZero};
constexpr Ip330CalibrationPoint k0V6125{0.6125, ip330::kSource0V6125};
constexpr Ip330CalibrationPoint k1V225{1.225, ip330::kSource1V2250};
constexpr Ip330CalibrationPoint k2V45{2.45, ip330::kSource2V4500};
constexpr Ip330CalibrationPoint k4V9{4.9, ip330::kSource4V9000};

constexpr std::array<std::array<Ip330CalibrationPoints, kIp330Gains>, 4> kPoints{{
    {{{kZero, k4V9}, {kZero, k2V45}, {kZero, k1V225}, {kZero, k0V6125}}},  // -5to5
    {{{kZero, k4V9}, {kZero, k4V9}, {kZero, k2V45}, {kZero, k1V225}}},  // -10to10
    {{{k0V6125, k4V9}, {k0V6125, k2V45}, {k0V6125, k1V225}, {kZero, k0V6125}}},  // 0to5
    {{{k0V6125, k4V9}, {k0V6125, k4V9}, {k0V6125, k2V45}, {k0V6125, k1V225}}},  // 0to10
}};

}  // namespace

Ip330CalibrationPoints calibrationPointsOf(Ip330Range range, int gain) noexcept {
  return kPoints[static_cast<std::size_t>(range)][static_cast<std::size_t>(gain)];
}

std::optional<Ip330Correction> correctionOf(Ip330Range range, int gain, double lowCode,
                                            double highCode) noexcept {
  const auto [low, high] = calibrationPointsOf(range, gain);
  const auto [zero, span] = spanOf(range);
  const double factor = kIp330Gain[static_cast<std::size_t>(gain)];
  if (highCode <= lowCode || lowCode < kEndCodes || highCode > kCodes - 1 - kEndCodes)
    return std::nullopt;
  const double voltsPerCode = factor * (high.volts - low.volts) / (highCode - lowCode);
  const Ip330Correction correction{kCodes * voltsPerCode / span,
                                   (low.volts * factor - zero) / voltsPerCode - lowCode};
  if (std::abs(correction.slope - 1) > kMostSlopeError) return std::nullopt;
  return correction;
}

int clampedCode(double corrected) noexcept {
  return static_cast<int>(std::clamp(std::round(corrected), 0.0, kCodes - 1));
}

}  // namespace mpf
