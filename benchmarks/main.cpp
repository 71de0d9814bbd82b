// SPDX-License-Identifier: MIT
// mpf-bench: what `mpf bench` starts.
#include <CLI/CLI.hpp>
#include <exception>
#include <fmt/format.h>

#include <mpf/benchmarks/local.h>

int main(int argc, char** argv) try {
  CLI::App app("mpf bench - how fast messages are, beside the physical floors and other message systems", "mpf bench");
  auto& local = *app.add_subcommand("local", mpf::bench::kLocalHelp);
  mpf::bench::LocalOptions options;
  mpf::bench::addOptions(local, options);
  app.require_subcommand(1);
  CLI11_PARSE(app, argc, argv);
  options.commandLine = "mpf bench";
  for (int i = 1; i < argc; ++i) options.commandLine += std::string(" ") + argv[i];
  return mpf::bench::runLocal(options);
} catch (const std::exception& error) {
  fmt::print(stderr, "mpf bench: {}\n", error.what());
  return 1;
}
