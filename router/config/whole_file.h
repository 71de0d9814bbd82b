// SPDX-License-Identifier: MIT
// WholeFile: a small file, read at once.
#pragma once

#include <string>

namespace mpf::router {

//   throws  std::system_error
[[nodiscard]] std::string readWholeFile(const std::string& file);

}  // namespace mpf::router
