// SPDX-License-Identifier: MIT
// Which crate a subcommand is for.
//
// Threads  one.
#pragma once

#include <string>

#include "crate/supervisor/crate_folder.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf::crate {

// Adds --crate.
void addCrateOption(CLI::App& command, std::string& crate);

// The crate of this name; if the name is empty, the only one that runs.
//   throws  std::runtime_error that says what to do when none or several run
[[nodiscard]] CrateFolder chooseCrate(const std::string& name);

}  // namespace mpf::crate
