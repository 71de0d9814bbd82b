// SPDX-License-Identifier: MIT
// The subcommands of `mpf`. Each function adds its subcommand to the command line; the subcommand
// that the user names sets `run`.
#pragma once

#include <functional>
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): a library's name
class App;
}

namespace mpf::tools {

// Does the work after parsing. Returns the exit status: 0 success, 1 failure, 2 usage error.
using Run = std::function<int()>;

void addCrate(CLI::App& app,
              Run& run);  // run, new, convert, ps, logs, capsule, stop, start, restart, reload
void addLs(CLI::App& app, Run& run);
void addMrr(CLI::App& app, Run& run);
void addMsr(CLI::App& app, Run& run);
void addTop(CLI::App& app, Run& run);
void addInspect(CLI::App& app, Run& run);
void addCall(CLI::App& app, Run& run);
void addSniff(CLI::App& app, Run& run);
void addGpibSniff(CLI::App& app, Run& run);
void addTap(CLI::App& app, Run& run);
void addReplay(CLI::App& app, Run& run);
void addClean(CLI::App& app, Run& run);
void addDoctor(CLI::App& app, Run& run);
void addTorture(CLI::App& app, Run& run);
void addBench(CLI::App& app, Run& run);

}  // namespace mpf::tools
