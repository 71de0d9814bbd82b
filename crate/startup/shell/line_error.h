// SPDX-License-Identifier: MIT
// LineError: what is wrong in a line, thrown by the parts that read it; the shell adds the place.
#pragma once

#include <cstddef>
#include <string>

namespace mpf::startup {

struct LineError {
  std::size_t column = 0;  // from 1
  std::string text;
};

}  // namespace mpf::startup
