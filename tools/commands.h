// SPDX-License-Identifier: MIT
// Commands: the subcommands of `mpf`. Each adds itself to the command line; the one that was called
// sets `run`.
#pragma once

#include <functional>
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): a library's name
class App;
}

namespace mpf::tools {

// Does the work after parsing. Returns the exit status: 0 done, 1 not, 2 asked for what cannot be.
using Run = std::function<int()>;

void addLs(CLI::App& app, Run& run);
void addMrr(CLI::App& app, Run& run);
void addMsr(CLI::App& app, Run& run);
void addTop(CLI::App& app, Run& run);
void addInspect(CLI::App& app, Run& run);
void addCall(CLI::App& app, Run& run);
void addSniff(CLI::App& app, Run& run);
void addTap(CLI::App& app, Run& run);
void addReplay(CLI::App& app, Run& run);
void addClean(CLI::App& app, Run& run);
void addDoctor(CLI::App& app, Run& run);
void addTorture(CLI::App& app, Run& run);
void addBench(CLI::App& app, Run& run);

}  // namespace mpf::tools
