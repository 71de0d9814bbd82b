// SPDX-License-Identifier: MIT
// mpf-crate: runs and supervises the processes of a crate file. `mpf run`, `mpf ps` and others
// execute it.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <sstream>
#include <string>

#include "base/command_line.h"
#include "base/print_error.h"
#include "base/run_main.h"
#include "base/toml/config_errors.h"
#include "crate/commands/commands.h"
#include "tools/text/wrap.h"

namespace {

constexpr const char* kFooter =
    "Each subcommand can be called as `mpf SUBCOMMAND`, too.\n"
    "Environment: MPF_CRATES, the folder that holds a folder for each crate; MPF_BACKPLANE.\n"
    "Exit status: 0 done; 1 failed, the text on stderr says why; 2 usage error, or errors in the "
    "crate file.";

// Prints the errors of a file: one begins a line, further lines of its text are indented.
void printErrors(const std::string& command, const mpf::ConfigError& errors) {
  std::istringstream lines(errors.what());
  for (std::string line; std::getline(lines, line);)
    mpf::printError("{}{}\n", line.starts_with(' ') ? "" : command + ": ", line);
}

// `mpf run` executes `mpf-crate run`: help and errors show what the user has typed.
bool isSubcommand(int argc, char** argv) { return argc > 1 && argv[1][0] != '-'; }

int runSubcommand(const std::string& command, int argc, char** argv) try {
  CLI::App app("mpf-crate - runs and supervises the processes of a crate file",
               isSubcommand(argc, argv) ? "mpf" : "mpf-crate");
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
  mpf::tools::fitToTerminal();
  return run();
} catch (const mpf::ConfigError& errors) {
  printErrors(command, errors);
  return mpf::kExitUsage;
}

}  // namespace

int main(int argc, char** argv) {
  // If the parent ignores SIGCHLD, so does this process, and the kernel reports no end of a child.
  ::signal(SIGCHLD, SIG_DFL);
  const auto command = isSubcommand(argc, argv) ? std::string("mpf ") + argv[1] : "mpf-crate";
  return mpf::runMain(command, [&] { return runSubcommand(command, argc, argv); });
}
