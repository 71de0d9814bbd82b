// SPDX-License-Identifier: MIT
// SerialSettings: the format of the characters on a serial line (manual, "initOctalUARTPort" and
// SerialConfigMessage).
#pragma once

#include <string>

namespace mpf {

// A field that is 0 keeps the present setting; when a port is opened, the options of the port say
// what 0 means.
struct SerialSettings {
  int baud = 0;  // bits per second
  int stopBits = 0;  // 1 or 2
  int bitsPerChar = 0;  // 5 to 8, without start, parity and stop bits
  char parity = 0;  // 'E'ven, 'O'dd, 'N'one
  char flowControl = 0;  // 'H'ardware (RTS/CTS), 'N'one

  friend bool operator==(const SerialSettings&, const SerialSettings&) = default;
};

// Returns a sentence that names the first value that no serial line can have, and the valid values;
// empty when all values are possible. A particular line may still refuse them; see
// SerialPort::config().
[[nodiscard]] std::string problemOf(const SerialSettings& settings);

// Returns `settings`, with each field of `changes` that is not 0 in its place.
[[nodiscard]] SerialSettings merged(SerialSettings settings,
                                    const SerialSettings& changes) noexcept;

}  // namespace mpf
