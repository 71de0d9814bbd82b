// SPDX-License-Identifier: MIT
// mpf-crate: runs and supervises the processes of a crate file. `mpf run`, `mpf ps` and others
// execute it.
#include <CLI/CLI.hpp>
#include <string>

#include "base/command_line.h"
#include "base/run_main.h"
#include "crate/commands/commands.h"
#include "tools/text/wrap.h"

namespace {

constexpr const char* kFooter =
    "Each subcommand can be called as `mpf SUBCOMMAND`, too.\n"
    "Environment: MPF_CRATES, the folder that holds a folder for each crate; MPF_BACKPLANE.\n"
    "Exit status: 0 done; 1 failed, the text on stderr says why; 2 usage error, or errors in the "
    "crate file.";

// Sets `program` to the name with which messages begin.
int runSubcommand(int argc, char** argv, std::string& program) {
  // `mpf run` executes `mpf-crate run`: help and errors show what the user has typed.
  const auto isSubcommand = argc > 1 && argv[1][0] != '-';
  CLI::App app("mpf-crate - runs and supervises the processes of a crate file",
               isSubcommand ? "mpf" : "mpf-crate");
  mpf::crate::Run run;
  mpf::crate::addRun(app, run);
  mpf::crate::addNew(app, run);
  mpf::crate::addConvert(app, run);
  mpf::crate::addPs(app, run);
  mpf::crate::addLogs(app, run);
  mpf::crate::addCapsule(app, run);
  mpf::crate::addControl(app, run);
  app.require_subcommand(1);
  app.footer(kFooter);
  if (const auto status = mpf::parseCommandLine(app, argc, argv)) return *status;
  program = app.get_name() + " " + app.get_subcommands().front()->get_name();
  mpf::tools::fitToTerminal();
  return run();
}

}  // namespace

int main(int argc, char** argv) {
  std::string program = "mpf-crate";
  return mpf::runMain(program, [&] { return runSubcommand(argc, argv, program); });
}
