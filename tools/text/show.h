// SPDX-License-Identifier: MIT
// show(): writes text to stdout immediately, without the buffer of stdio: a reader of a pipe sees
// each line at once, and no line is lost when a signal ends the program.
#pragma once

#include <unistd.h>

#include <string_view>

#include "base/system_call.h"

namespace mpf::tools {

// Blocks while the pipe is full.
//   throws  std::system_error when stdout cannot be written
inline void show(std::string_view text) {
  while (!text.empty()) {
    const auto written =
        retryInterrupted([&] { return ::write(STDOUT_FILENO, text.data(), text.size()); });
    text.remove_prefix(static_cast<std::size_t>(checkCall(written, "write", "stdout")));
  }
}

}  // namespace mpf::tools
