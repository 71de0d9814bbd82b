// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_settings.h"

#include <fmt/format.h>
#include <stdexcept>

#include "drivers/ip330/ip330_timing.h"

namespace mpf {
namespace {

struct RangeRow {
  const char* name;
  const char* switches;
  Ip330Span span;
};

constexpr std::array<RangeRow, 4> kRanges{{{"-5to5", "1011000010", {-5, 10}},
                                           {"-10to10", "0100110010", {-10, 20}},
                                           {"0to5", "1010100100", {0, 5}},
                                           {"0to10", "1011001000", {0, 10}}}};
constexpr std::array<const char*, 6> kScanModes{"disable",       "uniformContinuous",
                                                "uniformSingle", "burstContinuous",
                                                "burstSingle",   "convertOnExternalTriggerOnly"};

const RangeRow& rowOf(Ip330Range range) noexcept {
  return kRanges[static_cast<std::size_t>(range)];
}

}  // namespace

Ip330Span spanOf(Ip330Range range) noexcept { return rowOf(range).span; }
const char* dipSwitchesOf(Ip330Range range) noexcept { return rowOf(range).switches; }
const char* toString(Ip330Range range) noexcept { return rowOf(range).name; }
const char* toString(Ip330ScanMode mode) noexcept {
  return kScanModes[static_cast<std::size_t>(mode)];
}

Ip330Type parseIp330Type(const std::string& text) {
  if (text == "D") return Ip330Type::differential;
  if (text == "S") return Ip330Type::singleEnded;
  throw std::invalid_argument(
      fmt::format("type \"{}\": use D (differential) or S (single ended)", text));
}

Ip330Range parseIp330Range(const std::string& text) {
  for (std::size_t i = 0; i < kRanges.size(); ++i) {
    if (text == kRanges[i].name) return static_cast<Ip330Range>(i);
  }
  throw std::invalid_argument(fmt::format("range \"{}\": use -5to5, -10to10, 0to5 or 0to10", text));
}

Ip330Trigger parseIp330Trigger(const std::string& text) {
  if (text == "Input") return Ip330Trigger::input;
  if (text == "Output") return Ip330Trigger::output;
  throw std::invalid_argument(fmt::format("trigger \"{}\": use Input or Output", text));
}

Ip330ScanMode parseIp330ScanMode(int number) {
  if (number >= 0 && static_cast<std::size_t>(number) < kScanModes.size())
    return static_cast<Ip330ScanMode>(number);
  throw std::invalid_argument(
      fmt::format("scan mode {}: use 0 disable, 1 uniformContinuous, 2 uniformSingle, 3 "
                  "burstContinuous, 4 burstSingle, 5 convertOnExternalTriggerOnly",
                  number));
}

std::string Ip330Settings::problem() const {
  const int end = channelsOf(type);
  if (firstChannel < 0 || lastChannel >= end || firstChannel > lastChannel)
    return fmt::format("channels {} to {}: use 0 to {}, in ascending order", firstChannel,
                       lastChannel, end - 1);
  if (vector < 0 || vector > 255) return fmt::format("interrupt vector {}: use 0 to 255", vector);
  if (maxClients < 1) return fmt::format("maximum number of clients {}: use 1 or more", maxClients);
  return ip330TimerOf(scanMode, channels(), microsecondsPerScan).problem;
}

std::string Ip330Settings::problemOfChannels(int first, int last) const {
  if (has(first) && has(last) && first <= last) return {};
  const auto which = first == last ? fmt::format("channel {} is", first)
                                   : fmt::format("channels {} to {} are", first, last);
  return fmt::format("{} not available: the board scans {} to {}", which, firstChannel,
                     lastChannel);
}

}  // namespace mpf
