// SPDX-License-Identifier: MIT
// Screen: the terminal that `mpf top` draws on, by ncurses. The destructor restores the terminal.
//
// Threads  one, and one Screen in a process.
// Crash    an exception restores the terminal, too; after SIGKILL the user needs `reset`.
#pragma once

#include <optional>
#include <vector>

#include "tools/report/top_view.h"

namespace mpf::tools {

class Screen {
 public:
  // Throws std::runtime_error when stdin or stdout is not a terminal, or its type is unknown.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  [[nodiscard]] int rows() const noexcept;
  void draw(const std::vector<TopLine>& lines);
  // The next key that was pressed (TopKey), or 0 after a change of size; nullopt without a key.
  // Does not wait.
  std::optional<int> tryKey();
};

}  // namespace mpf::tools
