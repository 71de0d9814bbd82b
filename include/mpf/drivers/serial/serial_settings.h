// SPDX-License-Identifier: MIT
// SerialSettings: how a line is to be driven (manual, "initOctalUARTPort" and SerialConfigMessage).
#pragma once

#include <string>

namespace mpf {

// 0 in a field: leave as it is.
struct SerialSettings {
  int baud = 0;
  int stopBits = 0;  // 1, 2
  int bitsPerChar = 0;  // 5 to 8
  char parity = 0;  // 'E'ven, 'O'dd, 'N'one
  char flowControl = 0;  // 'H'ardware (RTS/CTS), 'N'one

  friend bool operator==(const SerialSettings&, const SerialSettings&) = default;
};

// Says which value is none that a line can have, in a sentence; empty when all are possible.
[[nodiscard]] std::string problemOf(const SerialSettings& settings);

// `changes` over `settings`.
[[nodiscard]] SerialSettings merged(SerialSettings settings,
                                    const SerialSettings& changes) noexcept;

}  // namespace mpf
