// SPDX-License-Identifier: MIT
// show(): text to stdout now, since a reader in a pipe wants it now. stdio would lose the line at which a signal ends the program.
#pragma once

#include <unistd.h>

#include <string_view>

#include <mpf/base/system_call.h>

namespace mpf::tools {

// Waits for a reader that is slow; drops the rest when there is none any more.
inline void show(std::string_view text) {
  while (!text.empty()) {
    const auto written = retryInterrupted([&] { return ::write(STDOUT_FILENO, text.data(), text.size()); });
    if (written < 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace mpf::tools
