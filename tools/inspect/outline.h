// SPDX-License-Identifier: MIT
// Outline: a tree of a dissection as text of 80 columns.
//
//   owner: pid 13514, program mpf-serial-server, user 0          an object of plain values is one
//   line requests:                                                    one that holds more is
//   indented
//     messages:
//       1748 freed   #1748 int32 timeout=0 ...                   messages are lines, bytes a
//       hexadecimal dump
//
// Threads  one.
#pragma once

#include <string>

#include "tools/inspect/dissect.h"

namespace mpf::tools {

[[nodiscard]] std::string outline(const Tree& tree, std::size_t indent = 0);

// Hexadecimal digits as lines of 16 bytes: offset, bytes, characters. A run of equal lines is one
// "*".
[[nodiscard]] std::string hexDump(const std::string& digits, std::size_t indent);

}  // namespace mpf::tools
