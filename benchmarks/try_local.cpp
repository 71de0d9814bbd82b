// SPDX-License-Identifier: MIT
// mpf-bench-local: `mpf bench local` by itself, for work on the measurements. Not installed.
#include <CLI/CLI.hpp>

#include <mpf/benchmarks/local.h>

int main(int argc, char** argv) {
  CLI::App app(mpf::bench::kLocalHelp);
  mpf::bench::LocalOptions options;
  mpf::bench::addOptions(app, options);
  CLI11_PARSE(app, argc, argv);
  for (int i = 0; i < argc; ++i) options.commandLine += (i == 0 ? "" : " ") + std::string(argv[i]);
  return mpf::bench::runLocal(options);
}
