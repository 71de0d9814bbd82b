// SPDX-License-Identifier: MIT
// mpf inspect: shows windows, hints, links, rings and pools in shared memory, decoded and raw.
// Works on a running system, on one whose processes hang or are dead, and on copies of its files.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>
#include <set>

#include "base/command_line.h"
#include "base/print_error.h"
#include "base/printable.h"
#include "shm/segment.h"
#include "tools/commands.h"
#include "tools/inspect/inspect_summary.h"
#include "tools/inspect/outline.h"
#include "tools/inspect/waits.h"
#include "tools/report/report.h"
#include "tools/text/json_text.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

struct InspectArguments : ReportArguments {
  std::vector<std::string> names;
  std::vector<std::string> files;
  std::optional<std::size_t> last;
  bool raw = false;
};

// The names of the command line, and which of them were found.
class Selection {
 public:
  explicit Selection(const std::vector<std::string>& names)
      : missing_(names.begin(), names.end()), names_(names) {}

  bool takes(const WindowView& window) {
    return takes([&](const std::string& name) {
      return name == window.name || name == serverText(window.name, window.location) ||
             isFile(name, window.file) || isNumber(name, window.incarnation);
    });
  }
  bool takes(const LinkView& link) {
    return takes([&](const std::string& name) {
      return isFile(name, link.file) || isNumber(name, link.incarnation);
    });
  }
  bool takes(const RouterView& router) {
    return takes([&](const std::string& name) {
      return name == router.name || isFile(name, router.file) || isNumber(name, router.incarnation);
    });
  }
  [[nodiscard]] const std::set<std::string>& missing() const noexcept { return missing_; }

 private:
  template <class Matches>
  bool takes(Matches matches) {
    bool taken = false;
    for (const auto& name : names_) {
      if (!matches(name)) continue;
      missing_.erase(name);
      taken = true;
    }
    return taken;
  }
  static bool isFile(const std::string& name, const std::string& file) {
    return name == file || name == segments::path(file);
  }
  // An incarnation, or at least its first kFewestDigits digits.
  static bool isNumber(const std::string& name, std::uint64_t incarnation) {
    return name.size() >= kFewestDigits && hex(incarnation).starts_with(name);
  }
  std::set<std::string> missing_;
  const std::vector<std::string>& names_;
};

// Dissects what the command line names and hands each tree to `give`, which prints it or collects
// it for JSON.
class Inspector {
 public:
  explicit Inspector(const InspectArguments& arguments) : arguments_(arguments) {}

  void window(const SnapshotDelta& delta, const WindowView& window,
              const std::function<void(const Tree&)>& give) {
    auto tree = dissect(window.file);
    if (!tree) return;
    (*tree)["state"] = delta.stateOf(window);
    Tree rows = Tree::array();
    std::vector<const LinkView*> links;
    for (const auto& link : window.links) {
      rows.push_back(linkRow(delta, link));
      links.push_back(&link);
    }
    if (arguments_.json) (*tree)["links"] = std::move(rows);
    if (!window.pendingBinds.empty()) (*tree)["waits_for"] = waitsFor(window);
    give(*tree);
    if (!arguments_.json) fmt::print("{}", linkTable(delta, links, kMostLinks));
    if (!arguments_.last) return;
    for (const auto* each : links) link(delta, *each, give);
  }
  void link(const SnapshotDelta& delta, const LinkView& link,
            const std::function<void(const Tree&)>& give) {
    auto tree = dissect(link.file);
    if (!tree) return;
    (*tree)["waits"] = waitsOf(delta, link);
    give(*tree);
  }
  void router(const SnapshotDelta& delta, const RouterView& router,
              const std::function<void(const Tree&)>& give) {
    auto tree = dissect(router.file);
    if (!tree) return;
    (*tree)["state"] = delta.stateOf(router);
    give(*tree);
  }

 private:
  static constexpr std::size_t kMostLinks = 100;
  // The absent servers that a client waits for.
  static Tree waitsFor(const WindowView& window) {
    Tree pendingBinds = Tree::array();
    for (const auto& pendingBind : window.pendingBinds)
      pendingBinds.push_back({{"server", pendingBind.server}, {"location", pendingBind.location}});
    return pendingBinds;
  }
  // nullopt when the file no longer exists, or cannot be read, which this prints.
  [[nodiscard]] std::optional<Tree> dissect(const std::string& file) const try {
    return tryDissect(segments::path(file),
                      {arguments_.last.value_or(DissectOptions().last), arguments_.raw});
  } catch (const std::exception& error) {
    printError("mpf inspect: {}\n", error.what());
    return std::nullopt;
  }
  const InspectArguments& arguments_;
};

// Prints a heading such as "link 3f6c01ac6b1a424f: idle", and then the tree.
void printTree(const Tree& tree) {
  auto rest = tree;
  std::string now;
  for (const char* key : {"state", "waits"}) {
    if (!tree.contains(key)) continue;
    now = ": " + tree.at(key).get<std::string>();
    rest.erase(key);
  }
  fmt::print("{}{}",
             wrap("",
                  tree.at("kind").get<std::string>() + " " +
                      tree.at("incarnation").get<std::string>() + now,
                  2),
             outline(rest, 2));
}

int inspectNamed(const InspectArguments& arguments) {
  std::vector<std::string> names;  // as reports show them
  for (const auto& name : arguments.names) names.push_back(printable(name));
  Selection selection(names);
  Inspector inspector(arguments);
  const auto visit = [&](const SnapshotDelta& delta, const std::function<void(const Tree&)>& give) {
    for (const auto* windows : {&delta.now().servers, &delta.now().clients}) {
      for (const auto& window : *windows) {
        if (selection.takes(window)) inspector.window(delta, window, give);
      }
    }
    for (const auto* link : linksOf(delta.now())) {
      if (selection.takes(*link)) inspector.link(delta, *link, give);
    }
    for (const auto& router : delta.now().routers) {
      if (selection.takes(router)) inspector.router(delta, router, give);
    }
  };
  reportEach(
      arguments, [&](const SnapshotDelta& delta) { visit(delta, printTree); },
      [&](const SnapshotDelta& delta, nlohmann::json& all) {
        visit(delta, [&](const Tree& tree) { all.push_back(nlohmann::json(tree)); });
      });
  for (const auto& name : selection.missing()) {
    printError(
        "mpf inspect: no server, client, link or router \"{}\"; `mpf inspect --json` lists all of "
        "them\n",
        name);
  }
  return selection.missing().empty() ? 0 : 1;
}

int inspectAll(const InspectArguments& arguments) {
  const int backplanes = reportEach(
      arguments, [](const SnapshotDelta& delta) { fmt::print("{}", summaryText(delta)); },
      [](const SnapshotDelta& delta, nlohmann::json& all) {
        all.push_back(nlohmann::json(summaryTree(delta)));
      });
  if (backplanes == 0 && !arguments.json) fmt::print("{}", kNoBackplane);
  return 0;
}

int inspectFiles(const InspectArguments& arguments) {
  auto all = nlohmann::json::array();
  int status = 0;
  for (const auto& file : arguments.files) {
    try {
      const auto tree =
          tryDissect(file, {arguments.last.value_or(DissectOptions().last), arguments.raw});
      if (!tree) throw SegmentError(file + ": the file does not exist");
      if (arguments.json) all.push_back(nlohmann::json(*tree));
      else printTree(*tree);
    } catch (const std::exception& error) {
      printError("mpf inspect: {}\n", error.what());
      status = 1;
    }
  }
  if (arguments.json) fmt::print("{}\n", jsonText(all));
  return status;
}

int inspect(const InspectArguments& arguments) {
  if (!arguments.files.empty()) return inspectFiles(arguments);
  return arguments.names.empty() ? inspectAll(arguments) : inspectNamed(arguments);
}

}  // namespace

void addInspect(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("inspect",
                                      "Shows windows, hints, links, rings and pools in shared "
                                      "memory, decoded and raw, and which process waits for "
                                      "which");
  auto arguments = std::make_shared<InspectArguments>();
  auto* names = command.add_option("name", arguments->names,
                                   "Servers, clients, routers, links (hexadecimal number, or at "
                                   "least its first 6 digits) or files of these; default: a "
                                   "summary");
  command
      .add_option("--file", arguments->files,
                  "Segment files in any folder, for example copies made after a failure; files "
                  "that belong to them are expected in the same folder")
      ->excludes(names);
  command
      .add_option(
          "--last", arguments->last,
          "Messages to show of each ring; default: 8. With a server or client: shows the rings of "
          "all of its links")
      ->check(wholeNumber(0, layout::kMaxRingSlots));
  command.add_flag("--raw", arguments->raw, "Show the bytes, too");
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return inspect(*arguments); }; });
}

}  // namespace mpf::tools
