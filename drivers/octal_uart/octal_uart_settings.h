// SPDX-License-Identifier: MIT
// OctalUartMode: SerialSettings as the values of the mode registers of an SCC2698B.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <mpf/drivers/serial/serial_settings.h>

namespace mpf {

struct OctalUartMode {
  std::uint8_t mr1 = 0;
  std::uint8_t mr2 = 0;
  std::uint8_t csr = 0;

  friend bool operator==(const OctalUartMode&, const OctalUartMode&) = default;
};

// Returns a sentence that names the first value that the chip does not support; empty when it
// supports all of them.
//   isRs485   RTS switches the transmitter on, and cannot be used for flow control
[[nodiscard]] std::string octalUartProblemOf(const SerialSettings& settings, bool isRs485);

// Requires that all fields of `settings` are set and octalUartProblemOf() is empty.
[[nodiscard]] OctalUartMode octalUartModeOf(const SerialSettings& settings);

// The settings of these register values. For models.
[[nodiscard]] SerialSettings settingsOf(const OctalUartMode& mode);

// The time that a byte needs on the line, with start, parity and stop bits.
[[nodiscard]] std::chrono::nanoseconds byteTime(const SerialSettings& settings) noexcept;

}  // namespace mpf
