// SPDX-License-Identifier: MIT
// The subcommands of mpf-crate: run, new, convert, ps, logs, capsule, stop, start, restart, reload.
// Each function adds its subcommands to the command line; the one that the user names sets `run`.
#pragma once

#include <functional>

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf::crate {

// Does the work after parsing. Returns the exit status: 0 success, 1 failure, 2 usage error.
using Run = std::function<int()>;

void addRun(CLI::App& app, Run& run);
void addNew(CLI::App& app, Run& run);
void addConvert(CLI::App& app, Run& run);
void addPs(CLI::App& app, Run& run);
void addLogs(CLI::App& app, Run& run);
void addCapsule(CLI::App& app, Run& run);
void addControl(CLI::App& app, Run& run);  // stop, start, restart, reload

}  // namespace mpf::crate
