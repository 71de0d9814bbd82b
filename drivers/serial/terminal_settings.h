// SPDX-License-Identifier: MIT
// Terminal settings: SerialSettings in the terms of termios2, which knows every speed, not only
// those that have a constant.
//
// Threads  one at a time per descriptor.
// Trust    a driver takes what it likes and reports no error: what it took is read back.
#pragma once

#include <chrono>
#include <string>

#include <mpf/drivers/serial/serial_settings.h>

namespace mpf::terminal {

// Bytes pass as they are, without echo; damaged ones are marked, see MarkDecoder. Returns empty or
// the reason.
[[nodiscard]] std::string tryMakeRaw(int fd);

// All or nothing. Returns empty, or a sentence that names the value that the line did not accept.
[[nodiscard]] std::string tryApply(int fd, const SerialSettings& settings);

// How long the line needs for `bytes` at its present speed, start, parity and stop bits included.
[[nodiscard]] std::chrono::microseconds timeFor(int fd, int bytes);

}  // namespace mpf::terminal
