// SPDX-License-Identifier: MIT
// mpf: runs servers, shows backplanes, servers and clients, and exchanges messages with them from
// the shell.
#include <CLI/CLI.hpp>
#include <string>

#include "base/command_line.h"
#include "base/run_main.h"
#include "tools/commands.h"
#include "tools/text/wrap.h"

namespace {

constexpr const char* kFooter =
    "Reports (ls, mrr, msr, top, inspect) only read: they disturb no process, remove nothing, and "
    "work when processes are stopped or dead.\n"
    "Environment: MPF_BACKPLANE, MPF_LOCATION, MPF_CRATES.\n"
    "Exit status: 0 success; 1 failure, the text on stderr says why; 2 usage error.";

// Appends the chosen subcommand to `program`.
int runSubcommand(int argc, char** argv, std::string& program) {
  CLI::App app(
      "mpf - runs servers, shows backplanes, servers and clients, and exchanges messages with them "
      "from the shell",
      "mpf");
  mpf::tools::Run run;
  mpf::tools::addCrate(app, run);
  mpf::tools::addLs(app, run);
  mpf::tools::addMrr(app, run);
  mpf::tools::addMsr(app, run);
  mpf::tools::addTop(app, run);
  mpf::tools::addInspect(app, run);
  mpf::tools::addCall(app, run);
  mpf::tools::addSniff(app, run);
  mpf::tools::addGpibSniff(app, run);
  mpf::tools::addTap(app, run);
  mpf::tools::addReplay(app, run);
  mpf::tools::addClean(app, run);
  mpf::tools::addDoctor(app, run);
  mpf::tools::addTorture(app, run);
  mpf::tools::addBench(app, run);
  app.require_subcommand(1);
  app.footer(kFooter);
  if (const auto status = mpf::parseCommandLine(app, argc, argv)) return *status;
  program += " " + app.get_subcommands().front()->get_name();
  mpf::tools::fitToTerminal();
  return run();
}

}  // namespace

int main(int argc, char** argv) {
  std::string program = "mpf";
  return mpf::runMain(program, [&] { return runSubcommand(argc, argv, program); });
}
