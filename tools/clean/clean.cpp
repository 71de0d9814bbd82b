// SPDX-License-Identifier: MIT
// mpf clean: removes the files that dead processes left, and reports how it knows that they are
// dead. Every program does so for its own backplane when it attaches; this subcommand is for
// backplanes that no program uses any more.
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include <mpf/backplane.h>

#include "base/print_error.h"
#include "base/printable.h"
#include "shm/segment.h"
#include "shm/stale_segments.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/text/json_text.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

using stale_segments::Judged;
using stale_segments::Verdict;

struct CleanArguments {
  std::string backplane;
  bool dryRun = false;
  bool json = false;
};

// The owner of a file that this user may not remove because another user owns it.
std::optional<uid_t> otherUser(const Judged& file) {
  struct stat status{};
  const auto self = ::geteuid();
  if (self == 0 || ::lstat(segments::path(file.name).c_str(), &status) != 0 ||
      status.st_uid == self)
    return std::nullopt;
  return status.st_uid;
}

const char* toString(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::alive:
      return "alive";
    case Verdict::dead:
      return "dead";
    case Verdict::unknown:
      return "unknown";
  }
  return "unknown";
}

class Cleaner {
 public:
  explicit Cleaner(const CleanArguments& arguments) : arguments_(arguments) {}

  void clean(const std::string& backplane) {
    for (const auto& file : stale_segments::judge(backplane)) {
      const auto stranger = file.verdict == Verdict::dead ? otherUser(file) : std::nullopt;
      const bool removed = !arguments_.dryRun && stale_segments::tryRemove(file);
      if (stranger && !removed) ++left_;
      if (arguments_.json) collect(file, removed);
      else if (file.verdict == Verdict::dead) reportDead(file, removed, stranger);
      else reportKept(file);
    }
  }
  // Returns the exit status.
  int end() {
    if (arguments_.json) fmt::print("{}\n", jsonText(files_));
    else if (!isAnythingDead_) printNothingToRemove();
    if (!arguments_.dryRun && unknown_ != 0)
      printError("mpf clean: {} could not be judged; `mpf clean --dry-run` says why\n",
                 counted(unknown_, "file"));
    if (arguments_.dryRun && !arguments_.json && alive_ != 0)
      fmt::print("{}: {}\n", counted(alive_, "file stays", "files stay"),
                 alive_ == 1 ? "its process is alive" : "their processes are alive");
    return left_ == 0 ? 0 : 1;
  }

 private:
  void printNothingToRemove() const {
    if (unknown_ == 0) fmt::print("nothing to remove: no dead process left anything\n");
    else fmt::print("nothing to remove: no file is known to be of a dead process\n");
  }
  void collect(const Judged& file, bool removed) {
    files_.push_back({{"file", segments::path(file.name)},
                      {"verdict", toString(file.verdict)},
                      {"reason", file.reason},
                      {"removed", removed}});
  }
  void reportDead(const Judged& file, bool removed, std::optional<uid_t> stranger) {
    const auto path = segments::path(file.name);
    isAnythingDead_ = isAnythingDead_ || removed || arguments_.dryRun || stranger;
    if (removed) {
      print("removed " + path, file.reason);
    } else if (stranger) {
      printError(
          "mpf clean: {} belongs to user {}, whose process is dead; that user or root may remove "
          "it\n",
          path, *stranger);
    } else if (arguments_.dryRun) {
      print("would remove " + path, file.reason);
    }
  }
  void reportKept(const Judged& file) {
    if (file.verdict == Verdict::alive) ++alive_;
    else ++unknown_;
    if (file.verdict == Verdict::unknown && arguments_.dryRun)
      print(segments::path(file.name) + " stays", file.reason);
  }
  static void print(const std::string& what, const std::string& reason) {
    fmt::print("{}{}", wrap("", printable(what) + ":", 4), wrap("  ", printable(reason), 2));
  }

  const CleanArguments& arguments_;
  nlohmann::json files_ = nlohmann::json::array();
  std::size_t left_ = 0;  // files of dead processes that only another user may remove
  std::size_t alive_ = 0;
  std::size_t unknown_ = 0;
  bool isAnythingDead_ = false;
};

int clean(const CleanArguments& arguments) {
  Cleaner cleaner(arguments);
  for (const auto& backplane : arguments.backplane.empty()
                                   ? Backplane::names()
                                   : std::vector{Backplane::named(arguments.backplane).name()}) {
    cleaner.clean(backplane);
  }
  return cleaner.end();
}

}  // namespace

void addClean(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("clean",
                                      "Removes the files that dead processes left in shared "
                                      "memory, and reports why they count as dead");
  auto arguments = std::make_shared<CleanArguments>();
  addBackplane(command, arguments->backplane, "all backplanes");
  command.add_flag("--dry-run", arguments->dryRun,
                   "Remove nothing; print what would be removed, and why");
  addJson(command, arguments->json);
  command.callback([arguments, &run] { run = [arguments] { return clean(*arguments); }; });
}

}  // namespace mpf::tools
