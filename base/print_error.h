// SPDX-License-Identifier: MIT
// printError(): prints a message to stderr and never throws.
//
//   printError("mpf-x: {}: {}\n", path, reason);
//
// Threads  any; a message is one call of write(), so messages do not mix. With an ErrorQueue: one.
// Crash    a message that cannot be written (stderr is closed, full, or a pipe without a reader) is
//          lost.
// Trust    the message may contain text of other processes, so printableLines() escapes it.
#pragma once

#include <fmt/format.h>
#include <string_view>

#include "base/printable.h"

namespace mpf {

// Writes bytes to stderr unchanged, for terminal control such as "\r". Ignores errors.
void writeError(std::string_view bytes) noexcept;

template <class... Arguments>
void printError(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
  try {
    writeError(printableLines(fmt::format(format, std::forward<Arguments>(arguments)...)));
  } catch (...) {
    writeError("a message could not be formatted: no memory\n");
  }
}

}  // namespace mpf
