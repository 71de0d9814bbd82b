// SPDX-License-Identifier: MIT
// printError(): a message on stderr that never fails the program that prints it.
//
//   printError("mpf-x: {}: {}\n", path, reason);
//
// Threads  any; a message is one call of write(), so messages do not mix.
// Crash    what cannot be written (stderr is closed, full, or a pipe without reader) is lost.
// Trust    the message may contain text of other processes: it goes through printableLines().
#pragma once

#include <fmt/format.h>
#include <string_view>

#include "base/printable.h"

namespace mpf {

// Writes bytes to stderr as they are: for terminal control such as "\r". Ignores errors.
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
