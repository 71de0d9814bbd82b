// SPDX-License-Identifier: MIT
// Ip330Settings: wiring, range and scan mode of a board, with the values of initIp330 and
// configIp330 (manual, "ip330Scan").
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace mpf {

inline constexpr int kIp330Channels = 32;  // 16 with differential inputs
inline constexpr int kIp330Gains = 4;

// Values of the startup commands: "D", "S".
enum class Ip330Type : std::uint8_t { differential, singleEnded };
// "-5to5", "-10to10", "0to5", "0to10". DIP switches set the range.
enum class Ip330Range : std::uint8_t { minus5to5, minus10to10, from0to5, from0to10 };
// "Input", "Output".
enum class Ip330Trigger : std::uint8_t { input, output };
enum class Ip330ScanMode : std::uint8_t {
  disable,  // no scans
  uniformContinuous,  // the channels one after the other, evenly over the period
  uniformSingle,  // the same, once for each trigger
  burstContinuous,  // all channels as fast as possible, then a pause until the end of the period
  burstSingle,  // the same, once for each trigger
  convertOnExternalTriggerOnly,  // one channel for each external trigger
};

// The gains of the codes 0 to 3.
inline constexpr std::array<double, kIp330Gains> kIp330Gain{1, 2, 4, 8};

// The voltage of a code at gain 1: volts = zero + code * span / 65536.
struct Ip330Span {
  double zero;
  double span;
};
[[nodiscard]] Ip330Span spanOf(Ip330Range range) noexcept;

// Positions of the DIP switches 1 to 10 for a range; '1' is on (manual, "ip330Scan").
[[nodiscard]] const char* dipSwitchesOf(Ip330Range range) noexcept;
[[nodiscard]] const char* toString(Ip330Range range) noexcept;
[[nodiscard]] const char* toString(Ip330ScanMode mode) noexcept;

// The number of channels of a board of this type.
[[nodiscard]] constexpr int channelsOf(Ip330Type type) noexcept {
  return type == Ip330Type::differential ? 16 : kIp330Channels;
}
// Returns whether the board scans repeatedly without triggers.
[[nodiscard]] constexpr bool isContinuous(Ip330ScanMode mode) noexcept {
  return mode == Ip330ScanMode::uniformContinuous || mode == Ip330ScanMode::burstContinuous;
}
// Returns whether the board scans once for each trigger.
[[nodiscard]] constexpr bool isSingle(Ip330ScanMode mode) noexcept {
  return mode == Ip330ScanMode::uniformSingle || mode == Ip330ScanMode::burstSingle;
}

// Read values of the startup commands.
//   throws  std::invalid_argument, which lists the valid values
[[nodiscard]] Ip330Type parseIp330Type(const std::string& text);
[[nodiscard]] Ip330Range parseIp330Range(const std::string& text);
[[nodiscard]] Ip330Trigger parseIp330Trigger(const std::string& text);
[[nodiscard]] Ip330ScanMode parseIp330ScanMode(int number);

struct Ip330Settings {
  Ip330Type type = Ip330Type::singleEnded;
  Ip330Range range = Ip330Range::minus5to5;
  int firstChannel = 0;
  int lastChannel = 15;
  int maxClients = 10;  // subscribers
  int vector = 0;  // interrupt vector, 0 to 255
  Ip330ScanMode scanMode = Ip330ScanMode::burstContinuous;
  Ip330Trigger trigger = Ip330Trigger::input;
  double microsecondsPerScan = 1000;
  int secondsBetweenCalibrate = 60;  // 0: once at start; negative: never, codes are not corrected

  [[nodiscard]] int channels() const noexcept { return lastChannel - firstChannel + 1; }
  [[nodiscard]] bool has(int channel) const noexcept {
    return channel >= firstChannel && channel <= lastChannel;
  }
  // Returns a sentence about the first invalid setting; empty when all are valid.
  [[nodiscard]] std::string problem() const;
  // The same about channels of a client of the board; empty when the board scans all of them.
  [[nodiscard]] std::string problemOfChannels(int first, int last) const;
};

}  // namespace mpf
