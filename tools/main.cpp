// SPDX-License-Identifier: MIT
// mpf: looks at backplanes, servers and clients, and talks to them from the shell.
#include <CLI/CLI.hpp>
#include <exception>
#include <fmt/format.h>

#include <mpf/tools/commands.h>

int main(int argc, char** argv) try {
  CLI::App app("mpf - looks at backplanes, servers and clients, and talks to them from the shell", "mpf");
  mpf::tools::Run run;
  mpf::tools::addLs(app, run);
  mpf::tools::addMrr(app, run);
  mpf::tools::addMsr(app, run);
  mpf::tools::addCall(app, run);
  mpf::tools::addSniff(app, run);
  mpf::tools::addClean(app, run);
  mpf::tools::addBench(app, run);
  app.require_subcommand(1);
  CLI11_PARSE(app, argc, argv);
  return run();
} catch (const std::exception& error) {
  fmt::print(stderr, "mpf: {}\n", error.what());
  return 1;
}
