// SPDX-License-Identifier: MIT
// Screen: the terminal that `mpf top` draws on, by ncurses. Its end restores the terminal.
//
// Threads  one, and one Screen a process.
// Crash    an exception restores it, too; SIGKILL does not (`reset` does).
#pragma once

#include <optional>
#include <vector>

#include "tools/report/top_view.h"

namespace mpf::tools {

class Screen {
 public:
  // Throws std::runtime_error when stdin or stdout is no terminal, or one that nothing is known of.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  [[nodiscard]] int rows() const noexcept;
  void draw(const std::vector<TopLine>& lines);
  // The next key that was pressed (TopKey), or a change of size (0); nullopt when there is none
  // now.
  std::optional<int> tryKey();
};

}  // namespace mpf::tools
