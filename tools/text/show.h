// SPDX-License-Identifier: MIT
// show(): text to stdout now, since a reader in a pipe wants it now. stdio would lose the line at
// which a signal ends the program.
#pragma once

#include <unistd.h>

#include <string_view>

#include "base/system_call.h"

namespace mpf::tools {

// Waits for a reader that is slow.
//   throws  std::system_error when it cannot be written
inline void show(std::string_view text) {
  while (!text.empty()) {
    const auto written =
        retryInterrupted([&] { return ::write(STDOUT_FILENO, text.data(), text.size()); });
    text.remove_prefix(static_cast<std::size_t>(checkCall(written, "write", "stdout")));
  }
}

}  // namespace mpf::tools
