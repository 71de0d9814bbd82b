// SPDX-License-Identifier: MIT
// mpf clean: removes what dead processes left. Every program does so for its own backplane when it attaches; this is for backplanes
// that no program uses any more.
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>

#include <mpf/shm/backplane.h>
#include <mpf/shm/segment.h>
#include <mpf/shm/segment_name.h>
#include <mpf/tools/arguments.h>
#include <mpf/tools/commands.h>

namespace mpf::tools {
namespace {

// What a dead process left and this one may not remove: it is another user's. Returns how many.
std::size_t nameTheRest(const std::string& backplane) {
  std::size_t left = 0;
  for (const auto& name : Backplane::named(backplane).segmentNames()) {
    const auto parsed = SegmentName::tryParse(name);
    if (!parsed || (parsed->kind != NameKind::serverWindow && parsed->kind != NameKind::clientWindow)) continue;
    struct stat status{};
    if (::lstat(segments::path(name).c_str(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid == ::geteuid()) continue;
    if (segments::probeOwner(name) != segments::Owner::dead) continue;
    fmt::print(stderr, "mpf clean: {} belongs to user {}, whose process is dead; that user or root may remove it\n", segments::path(name),
               status.st_uid);
    ++left;
  }
  return left;
}

int clean(const std::string& chosen) {
  std::size_t removed = 0;
  std::size_t left = 0;
  for (const auto& backplane : chosen.empty() ? Backplane::names() : std::vector{chosen}) {
    for (const auto& name : Backplane::named(backplane).removeDead()) {
      fmt::print("removed {}\n", segments::path(name));
      ++removed;
    }
    left += nameTheRest(backplane);
  }
  if (removed + left == 0) fmt::print("nothing to remove: no dead process left anything\n");
  return left == 0 ? 0 : 1;
}

}  // namespace

void addClean(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("clean", "Removes what dead processes left in shared memory, after proof by their locks");
  auto backplane = std::make_shared<std::string>();
  addBackplane(command, *backplane, "all that there are");
  command.callback([backplane, &run] { run = [backplane] { return clean(*backplane); }; });
}

}  // namespace mpf::tools
