// SPDX-License-Identifier: MIT
// writeCrate(): the text of a crate file, which readCrate() reads as the same crate.
//
// Threads  any.
#pragma once

#include <string>

#include "crate/config/crate.h"

namespace mpf::crate {

//   heading  lines for the top of the file, without "# "
[[nodiscard]] std::string writeCrate(const Crate& crate, const std::string& heading);

}  // namespace mpf::crate
