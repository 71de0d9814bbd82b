// SPDX-License-Identifier: MIT
// mpf torture, mpf bench: execute mpf-torture and mpf-bench. These are programs of their own, so
// that `mpf` does not depend on the libraries that only they need: libelf, and those with which MPF
// is compared.
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/program_beside.h"
#include "tools/commands.h"

namespace mpf::tools {
namespace {

// A subcommand that passes all its arguments to mpf-NAME.
void addProgram(CLI::App& app, Run& run, const char* name, const char* purpose,
                const char* remedy) {
  auto& command = *app.add_subcommand(name, fmt::format("{}; see `mpf {} --help`", purpose, name));
  command.prefix_command();
  command.set_help_flag();
  command.callback([&command, &run, remedy] {
    run = [&command, remedy] {
      return executeBeside("mpf-" + command.get_name(), command.remaining(), remedy);
    };
  });
}

}  // namespace

void addTorture(CLI::App& app, Run& run) {
  addProgram(app, run, "torture",
             "Kills clients and servers at each step, and checks that all other processes continue",
             "install it in the same folder as mpf");
}

void addBench(CLI::App& app, Run& run) {
  addProgram(app, run, "bench", "Measures the speed of messages",
             "build MPF with MPF_BUILD_BENCHMARKS=ON to get this program");
}

}  // namespace mpf::tools
