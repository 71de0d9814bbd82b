// SPDX-License-Identifier: MIT
// mpf run, mpf torture, mpf bench and others: execute mpf-crate, mpf-torture and mpf-bench. These
// are programs of their own, so that `mpf` does not depend on the libraries that only they need:
// toml++, libelf, and those with which MPF is compared.
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/program_beside.h"
#include "tools/commands.h"

namespace mpf::tools {
namespace {

constexpr const char* kInstall =
    "install MPF with `make install`: the Python package does not have this program";

// A subcommand that passes all its arguments to `program`.
//   before  arguments before those of the user
void addProgram(CLI::App& app, Run& run, const std::string& name, const std::string& purpose,
                const std::string& program, const std::vector<std::string>& before,
                const char* remedy) {
  auto& command = *app.add_subcommand(name, purpose);
  command.prefix_command();
  command.set_help_flag();
  command.callback([&command, &run, program, before, remedy] {
    run = [&command, program, before, remedy] {
      auto arguments = before;
      const auto others = command.remaining();
      arguments.insert(arguments.end(), others.begin(), others.end());
      return executeProgram(program, arguments, remedy);
    };
  });
}

}  // namespace

void addCrate(CLI::App& app, Run& run) {
  for (const auto& [name, purpose] : std::vector<std::pair<const char*, const char*>>{
           {"run", "Starts the servers, routers and IOCs of a crate, and supervises them"},
           {"new", "Writes a new crate file, or the JSON schema of crate files"},
           {"convert", "Converts a startup file of the original MPF to a crate file"},
           {"ps", "Lists the processes of crates, with their states and restarts"},
           {"logs", "Shows what a process of a crate has printed"},
           {"capsule", "Shows the crash report of a process"},
           {"stop", "Stops a process of a crate, or the whole crate"},
           {"start", "Starts a process of a crate that was stopped or has failed"},
           {"restart", "Restarts a process of a crate"},
           {"reload", "Reads a crate file again, and restarts what has changed"}})
    addProgram(app, run, name, purpose, "mpf-crate", {name}, kInstall);
}

void addTorture(CLI::App& app, Run& run) {
  addProgram(app, run, "torture",
             "Kills clients and servers at each step, and checks that all other processes "
             "continue; see `mpf torture --help`",
             "mpf-torture", {}, kInstall);
}

void addBench(CLI::App& app, Run& run) {
  addProgram(app, run, "bench", "Measures the speed of messages; see `mpf bench --help`",
             "mpf-bench", {}, "build MPF with MPF_BUILD_BENCHMARKS=ON to get this program");
}

}  // namespace mpf::tools
