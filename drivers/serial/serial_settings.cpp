// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/serial_settings.h>

#include <fmt/format.h>
#include <string_view>

namespace mpf {
namespace {

bool isOneOf(char value, std::string_view values) noexcept {
  return value == 0 || values.find(value) != std::string_view::npos;
}

// A client may send any byte. A byte that is not printable is shown as a number.
std::string shown(char value) {
  return value > ' ' && value <= '~' ? fmt::format("'{}'", value)
                                     : fmt::format("0x{:02x}", static_cast<unsigned char>(value));
}

}  // namespace

std::string problemOf(const SerialSettings& settings) {
  const auto& [baud, stopBits, bitsPerChar, parity, flowControl] = settings;
  if (baud < 0) return fmt::format("baud {}: must be positive", baud);
  if (stopBits < 0 || stopBits > 2) return fmt::format("stop bits {}: must be 1 or 2", stopBits);
  if (bitsPerChar != 0 && (bitsPerChar < 5 || bitsPerChar > 8))
    return fmt::format("bits per character {}: must be 5 to 8", bitsPerChar);
  if (!isOneOf(parity, "EON"))
    return fmt::format("parity {}: must be 'E', 'O' or 'N'", shown(parity));
  if (!isOneOf(flowControl, "HN"))
    return fmt::format("flow control {}: must be 'H' or 'N'", shown(flowControl));
  return {};
}

SerialSettings merged(SerialSettings settings, const SerialSettings& changes) noexcept {
  const auto change = [](auto& value, auto to) {
    if (to != 0) value = to;
  };
  change(settings.baud, changes.baud);
  change(settings.stopBits, changes.stopBits);
  change(settings.bitsPerChar, changes.bitsPerChar);
  change(settings.parity, changes.parity);
  change(settings.flowControl, changes.flowControl);
  return settings;
}

}  // namespace mpf
