// SPDX-License-Identifier: MIT
// Reads small files.
#pragma once

#include <string>

namespace mpf {

// Returns the whole content of a file.
//   throws  std::system_error
[[nodiscard]] std::string readWholeFile(const std::string& file);

}  // namespace mpf
