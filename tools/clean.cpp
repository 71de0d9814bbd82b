// SPDX-License-Identifier: MIT
// mpf clean: removes what dead processes left. Every program does so for its own backplane when it attaches; this is for backplanes
// that no program uses any more.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>

#include <mpf/shm/backplane.h>
#include <mpf/shm/segment.h>
#include <mpf/tools/arguments.h>
#include <mpf/tools/commands.h>

namespace mpf::tools {
namespace {

int clean(const std::string& chosen) {
  std::size_t removed = 0;
  for (const auto& backplane : chosen.empty() ? Backplane::names() : std::vector{chosen}) {
    for (const auto& name : Backplane::named(backplane).removeDead()) {
      fmt::print("removed {}\n", segments::path(name));
      ++removed;
    }
  }
  if (removed == 0) fmt::print("nothing to remove: no dead process left anything\n");
  return 0;
}

}  // namespace

void addClean(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("clean", "Removes what dead processes left in shared memory, after proof by their locks");
  auto backplane = std::make_shared<std::string>();
  addBackplane(command, *backplane, "all that there are");
  command.callback([backplane, &run] { run = [backplane] { return clean(*backplane); }; });
}

}  // namespace mpf::tools
