// SPDX-License-Identifier: MIT
// Outline: the tree of a dissection as text that fits the terminal.
//
//   owner: pid 13514, program mpf-serial-server, user 0    an object of plain values is one line
//   requests:                                              other objects are indented
//     messages:
//       1748 freed   #1748 int32 timeout=0 ...             messages are lines, bytes a hex dump
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
