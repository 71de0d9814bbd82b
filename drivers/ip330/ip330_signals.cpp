// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_signals.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "base/number.h"
#include "drivers/ip330/ip330_settings.h"

namespace mpf {
namespace {

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.emplace_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <class Number>
Number parseNumber(const std::string& text) {
  if (const auto number = tryNumber<Number>(text); number && std::isfinite(*number)) return *number;
  throw std::invalid_argument(fmt::format("\"{}\" is not a number", text));
}

Ip330Signal parseDc(const std::string& parameters) {
  return dcSignal(parseNumber<double>(parameters));
}

Ip330Signal parseSine(const std::string& parameters) {
  const auto parts = split(parameters, ':');
  if (parts.size() < 2 || parts.size() > 3)
    throw std::invalid_argument("use sine:FREQUENCY:AMPLITUDE[:OFFSET]");
  return sineSignal(parseNumber<double>(parts[0]), parseNumber<double>(parts[1]),
                    parts.size() == 3 ? parseNumber<double>(parts[2]) : 0);
}

Ip330Signal parseSignal(const std::string& text,
                        const std::map<std::string, Ip330SignalKind>& others) {
  const auto colon = text.find(':');
  const auto kind = text.substr(0, colon);
  const auto parameters = colon == std::string::npos ? std::string() : text.substr(colon + 1);
  if (kind == "dc") return parseDc(parameters);
  if (kind == "sine") return parseSine(parameters);
  if (const auto other = others.find(kind); other != others.end()) return other->second(parameters);
  std::string kinds = "dc, sine";
  for (const auto& [other, make] : others) kinds += ", " + other;
  throw std::invalid_argument(
      fmt::format("unknown kind of signal \"{}\"; use one of {}", kind, kinds));
}

int parseChannel(const std::string& text) {
  const int channel = parseNumber<int>(text);
  if (channel < 0 || channel >= kIp330Channels)
    throw std::invalid_argument(
        fmt::format("no channel {}; use 0 to {}", channel, kIp330Channels - 1));
  return channel;
}

}  // namespace

Ip330Signal dcSignal(double volts) {
  return [volts](double) { return volts; };
}

Ip330Signal sineSignal(double hertz, double amplitude, double offset) {
  return [=](double seconds) {
    return offset + amplitude * std::sin(2 * std::numbers::pi * hertz * seconds);
  };
}

std::map<int, Ip330Signal> parseIp330Signals(const std::string& text,
                                             const std::map<std::string, Ip330SignalKind>& others) {
  std::map<int, Ip330Signal> signals;
  for (const auto& part : split(text, ',')) {
    const auto equals = part.find('=');
    try {
      if (equals == std::string::npos) throw std::invalid_argument("use CHANNEL=KIND:PARAMETERS");
      signals[parseChannel(part.substr(0, equals))] = parseSignal(part.substr(equals + 1), others);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("signal \"{}\": {}", part, error.what()));
    }
  }
  return signals;
}

}  // namespace mpf
