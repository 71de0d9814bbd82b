// SPDX-License-Identifier: MIT
// Ip330Timer: the chip's two timer registers for a time per scan, and the time that comes of them.
//
//   uniform   each timer period converts one channel                          period of a scan = channels * timer
//   burst     each timer period converts all channels, then the timer runs    period of a scan = channels * 15 us + timer
//   timer = prescaler * conversion / 8 us: the clock has 8 MHz; prescaler 64 to 255, conversion 1 to 65535
//
// Source   IP330 manual, "Conversion timer". The old driver clamped what cannot be and added the 15 us in every mode; here it is an error.
#pragma once

#include <cstdint>
#include <string>

#include <mpf/drivers/ip330/ip330_settings.h>

namespace mpf {

inline constexpr double kIp330MicrosecondsPerConversion = 15;

struct Ip330Timer {
  std::uint8_t prescaler = 64;
  std::uint16_t conversion = 65535;
  bool isUsed = false;  // false in the single burst, in externally triggered scans and when disabled
  double microsecondsPerScan = 0;  // what the registers make of it; 0 when nobody but a trigger knows
  std::string problem;  // empty, or why there are no such registers

  [[nodiscard]] double microseconds() const noexcept { return prescaler * static_cast<double>(conversion) / 8; }
};

[[nodiscard]] Ip330Timer ip330TimerOf(Ip330ScanMode mode, int channels, double microsecondsPerScan);

}  // namespace mpf
