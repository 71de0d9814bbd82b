// SPDX-License-Identifier: MIT
// Ip330Settings: how a board is wired, jumpered and scanned, in the words of initIp330 and configIp330.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace mpf {

inline constexpr int kIp330Channels = 32;  // 16 when differential
inline constexpr int kIp330Gains = 4;

enum class Ip330Type : std::uint8_t { differential, singleEnded };                    // "D", "S"
enum class Ip330Range : std::uint8_t { minus5to5, minus10to10, from0to5, from0to10 };  // DIP switches on the board: "-5to5", ...
enum class Ip330Trigger : std::uint8_t { input, output };                              // "Input", "Output"
enum class Ip330ScanMode : std::uint8_t {
  disable,
  uniformContinuous,  // one channel after the other, evenly over the period
  uniformSingle,
  burstContinuous,  // all channels at once, then nothing until the period is over
  burstSingle,
  convertOnExternalTriggerOnly,
};

// The gain that code 0 to 3 stands for.
inline constexpr std::array<double, kIp330Gains> kIp330Gain{1, 2, 4, 8};

// What a code stands for at gain 1: volts = zero + code * span / 65536.
struct Ip330Span {
  double zero;
  double span;
};
[[nodiscard]] Ip330Span spanOf(Ip330Range range) noexcept;

// Switches 1 to 10 of a range, '1' is on (manual, "ip330Scan").
[[nodiscard]] const char* dipSwitchesOf(Ip330Range range) noexcept;
[[nodiscard]] const char* toString(Ip330Range range) noexcept;
[[nodiscard]] const char* toString(Ip330ScanMode mode) noexcept;

// Channels that a board of this type has.
[[nodiscard]] constexpr int channelsOf(Ip330Type type) noexcept { return type == Ip330Type::differential ? 16 : kIp330Channels; }
// Whether it scans again and again without being told to.
[[nodiscard]] constexpr bool isContinuous(Ip330ScanMode mode) noexcept {
  return mode == Ip330ScanMode::uniformContinuous || mode == Ip330ScanMode::burstContinuous;
}
// Whether it scans once, each time that it is told to.
[[nodiscard]] constexpr bool isSingle(Ip330ScanMode mode) noexcept {
  return mode == Ip330ScanMode::uniformSingle || mode == Ip330ScanMode::burstSingle;
}

//   throws  std::invalid_argument that says which values there are
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
  int vector = 0;
  Ip330ScanMode scanMode = Ip330ScanMode::burstContinuous;
  Ip330Trigger trigger = Ip330Trigger::input;
  double microsecondsPerScan = 1000;
  int secondsBetweenCalibrate = 60;  // 0: once; below: never, and values are as the converter gave them

  [[nodiscard]] int channels() const noexcept { return lastChannel - firstChannel + 1; }
  [[nodiscard]] bool has(int channel) const noexcept { return channel >= firstChannel && channel <= lastChannel; }
  // Empty when they can be, else what is wrong, in a sentence.
  [[nodiscard]] std::string problem() const;
};

}  // namespace mpf
