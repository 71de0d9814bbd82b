// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_timing.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace mpf {
namespace {

constexpr double kTicksPerMicrosecond = 8;
constexpr double kLeastPrescaler = 0x40;
constexpr double kMostPrescaler = 0xff;
constexpr double kMostConversion = 0xffff;
constexpr double kLeastTimer = kLeastPrescaler / kTicksPerMicrosecond;
constexpr double kMostTimer = kMostPrescaler * kMostConversion / kTicksPerMicrosecond;

// Chooses the smallest prescaler for which the conversion register is large enough: it has the
// finest steps.
void setTimer(Ip330Timer& timer, double microseconds) {
  const double ticks = std::max(microseconds, kLeastTimer) * kTicksPerMicrosecond;
  double prescaler =
      std::clamp(std::ceil(ticks / kMostConversion), kLeastPrescaler, kMostPrescaler);
  if (std::round(ticks / prescaler) > kMostConversion)
    prescaler = std::min(prescaler + 1, kMostPrescaler);
  timer.prescaler = static_cast<std::uint8_t>(prescaler);
  timer.conversion =
      static_cast<std::uint16_t>(std::clamp(std::round(ticks / prescaler), 1.0, kMostConversion));
}

// The time of a scan: `fixed` plus `periods` periods of the timer, each at least `least` [us].
struct Shape {
  double fixed;
  double periods;
  double least;
};

Shape shapeOf(Ip330ScanMode mode, int channels) {
  if (mode == Ip330ScanMode::burstContinuous)
    return {channels * kIp330MicrosecondsPerConversion, 1, kLeastTimer};
  return {0, static_cast<double>(channels), kIp330MicrosecondsPerConversion};
}

bool usesTimer(Ip330ScanMode mode) {
  return mode == Ip330ScanMode::uniformContinuous || mode == Ip330ScanMode::uniformSingle ||
         mode == Ip330ScanMode::burstContinuous;
}

}  // namespace

Ip330Timer ip330TimerOf(Ip330ScanMode mode, int channels, double microsecondsPerScan) {
  Ip330Timer timer;
  if (mode == Ip330ScanMode::burstSingle)
    timer.microsecondsPerScan = channels * kIp330MicrosecondsPerConversion;
  if (!usesTimer(mode)) return timer;
  const auto shape = shapeOf(mode, channels);
  const double least = shape.fixed + shape.periods * shape.least;
  const double most = shape.fixed + shape.periods * kMostTimer;
  // false for NaN, too
  const bool isPossible = microsecondsPerScan >= least && microsecondsPerScan <= most;
  if (!isPossible) {
    timer.problem =
        fmt::format("{} us per scan of {} channels in mode {}: use {} to {} us",
                    microsecondsPerScan, channels, toString(mode), least, std::floor(most));
    return timer;
  }
  timer.isUsed = true;
  setTimer(timer, (microsecondsPerScan - shape.fixed) / shape.periods);
  timer.microsecondsPerScan = shape.fixed + shape.periods * timer.microseconds();
  return timer;
}

}  // namespace mpf
