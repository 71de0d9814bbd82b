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
//   throws  std::runtime_error that says what to do when none or several run, or when only the
//           processes of a crate run, because its supervisor has ended
[[nodiscard]] CrateFolder chooseCrate(const std::string& name);
// The same for its logs and crash reports: without a crate that runs, the only one that has files.
//   throws  std::runtime_error that names the crates if it cannot choose one
[[nodiscard]] CrateFolder chooseFiles(const std::string& name);

// What to do about processes whose supervisor has ended; empty: the crate has none.
[[nodiscard]] std::string textOfUnsupervised(const CrateFolder& folder);

}  // namespace mpf::crate
