// SPDX-License-Identifier: MIT
// Terminal settings: applies SerialSettings with termios2, which can set any speed, not only those
// that have a constant.
//
// Threads  one caller at a time for each descriptor.
// Trust    a driver may ignore a setting without an error, so the settings are read back.
#pragma once

#include <chrono>
#include <string>

#include <mpf/drivers/serial/serial_settings.h>

namespace mpf::terminal {

// Sets the raw mode: bytes pass unchanged and without echo, and damaged bytes are marked (see
// MarkDecoder). Returns empty or the reason of the failure.
[[nodiscard]] std::string tryMakeRaw(int fd);

// Applies all settings, or none.
//   returns  empty; or a sentence that names the value that the line did not accept
[[nodiscard]] std::string tryApply(int fd, const SerialSettings& settings);

// The time that the line needs for `bytes` at its present speed, with start, parity and stop bits;
// 0 when it is unknown.
[[nodiscard]] std::chrono::microseconds timeFor(int fd, int bytes);

}  // namespace mpf::terminal
