// SPDX-License-Identifier: MIT
// mpf bench: executes mpf-bench. That is a program of its own, so that `mpf` does not depend on the
// libraries that MPF is compared with.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <vector>

#include "base/print_error.h"
#include "tools/commands.h"

namespace mpf::tools {
namespace {

int bench(std::vector<std::string> words) {
  const auto program =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "mpf-bench").string();
  words.insert(words.begin(), program);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execv(program.c_str(), arguments.data());
  printError(
      "mpf bench: cannot start {}: {}; build MPF with MPF_BUILD_BENCHMARKS=ON to get this "
      "program\n",
      program, std::strerror(errno));
  return 1;
}

}  // namespace

void addBench(CLI::App& app, Run& run) {
  auto& command =
      *app.add_subcommand("bench", "Measures the speed of messages; see `mpf bench --help`");
  command.prefix_command();
  command.set_help_flag();
  command.callback(
      [&command, &run] { run = [words = command.remaining()] { return bench(words); }; });
}

}  // namespace mpf::tools
