// SPDX-License-Identifier: MIT
// SerialSettings as an SCC2698B has them in its registers.
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

// Says which value the chip does not have, in a sentence; empty when it can be driven so.
//   isRs485   RTS switches the transmitter on and is not there for flow control
[[nodiscard]] std::string octalUartProblemOf(const SerialSettings& settings, bool isRs485);

// All fields of `settings` must be set, and octalUartProblemOf() them empty.
[[nodiscard]] OctalUartMode octalUartModeOf(const SerialSettings& settings);

// The reverse, for models.
[[nodiscard]] SerialSettings settingsOf(const OctalUartMode& mode);

// What a byte needs on the line, start, parity and stop bits included.
[[nodiscard]] std::chrono::nanoseconds byteTime(const SerialSettings& settings) noexcept;

}  // namespace mpf
