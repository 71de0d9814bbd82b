// SPDX-License-Identifier: MIT
// Ip330Timer: the two timer registers of the chip for a time per scan, and the exact time that they
// give.
//
//   uniform   each timer period converts one channel
//             period of a scan = channels * timer
//   burst     each timer period converts all channels, then the timer runs
//             period of a scan = channels * 15 us + timer
//   timer = prescaler * conversion / 8 us (clock 8 MHz); prescaler 64 to 255, conversion 1 to 65535
//
// Threads  any number of callers at a time.
// Source   IP330 manual, "Conversion timer". EPICS ip330 clamped impossible times, which are errors
//          here, and added the 15 us in every mode.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/ip330/ip330_settings.h"

namespace mpf {

inline constexpr double kIp330MicrosecondsPerConversion = 15;

struct Ip330Timer {
  std::uint8_t prescaler = 64;
  std::uint16_t conversion = 65535;
  bool isUsed = false;  // false for single bursts, external triggers and disabled scans
  // the time that the registers give; 0 when it depends on triggers
  double microsecondsPerScan = 0;
  std::string problem;  // why no register values give this time; empty if valid

  [[nodiscard]] double microseconds() const noexcept {
    return prescaler * static_cast<double>(conversion) / 8;
  }
};

// Returns the timer for a number of channels and a time per scan [us].
[[nodiscard]] Ip330Timer ip330TimerOf(Ip330ScanMode mode, int channels, double microsecondsPerScan);

}  // namespace mpf
