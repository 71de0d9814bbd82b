// SPDX-License-Identifier: MIT
// mpf: looks at backplanes, servers and clients, and talks to them from the shell.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <stdexcept>

#include <mpf/tools/commands.h>

namespace {

constexpr const char* kFooter =
    "Reports (ls, mrr, msr, top, inspect) only read: they disturb nobody, remove nothing, and work when a process is stopped or dead.\n"
    "Environment: MPF_BACKPLANE, MPF_LOCATION.\n"
    "Exit status: 0 done; 1 not done, the text on stderr says why; 2 asked for what cannot be.";

std::string subcommandNames(const CLI::App& app) {
  std::string names;
  for (const auto* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names += (names.empty() ? "" : ", ") + command->get_name();
  }
  return names;
}

// What is wrong with the command line, and where one can read how it is right. Returns the exit status.
int explain(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help
  const auto chosen = app.get_subcommands();
  if (!chosen.empty()) {
    const auto name = chosen.front()->get_name();
    fmt::print(stderr, "mpf {}: {}; `mpf {} --help` shows how to use it\n", name, error.what(), name);
  } else if (const auto words = app.remaining(); !words.empty()) {
    fmt::print(stderr, "mpf: no subcommand or option \"{}\"; there are {}; `mpf --help` shows what they do\n", words.front(),
               subcommandNames(app));
  } else {
    fmt::print(stderr, "{}", app.help());
  }
  return 2;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app("mpf - looks at backplanes, servers and clients, and talks to them from the shell", "mpf");
  mpf::tools::Run run;
  mpf::tools::addLs(app, run);
  mpf::tools::addMrr(app, run);
  mpf::tools::addMsr(app, run);
  mpf::tools::addTop(app, run);
  mpf::tools::addInspect(app, run);
  mpf::tools::addCall(app, run);
  mpf::tools::addSniff(app, run);
  mpf::tools::addTap(app, run);
  mpf::tools::addReplay(app, run);
  mpf::tools::addClean(app, run);
  mpf::tools::addDoctor(app, run);
  mpf::tools::addTorture(app, run);
  mpf::tools::addBench(app, run);
  app.require_subcommand(1);
  app.footer(kFooter);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return explain(app, error);
  }
  const int status = run();
  // A full disk is found when what was printed is written.
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) throw std::runtime_error("not all of the output could be written");
  return status;
} catch (const std::invalid_argument& error) {
  fmt::print(stderr, "mpf: {}\n", error.what());
  return 2;
} catch (const std::exception& error) {
  fmt::print(stderr, "mpf: {}\n", error.what());
  return 1;
}
