// SPDX-License-Identifier: MIT
// mpf capsule: shows the crash report of a process, or lists those of a folder.
#include "crate/capsule/capsule.h"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <fmt/format.h>
#include <memory>
#include <stdexcept>
#include <system_error>

#include "base/printable.h"
#include "crate/capsule/capsule_store.h"
#include "crate/capsule/capsule_text.h"
#include "crate/commands/commands.h"
#include "crate/commands/control.h"
#include "tools/text/json_text.h"
#include "tools/text/show.h"

namespace mpf::crate {
namespace {

struct CapsuleArguments {
  std::string file, folder, crate;
  bool isJson = false;
};

int showCapsule(const CapsuleArguments& arguments) try {
  const auto capsule = readCapsule(arguments.file);
  tools::show(arguments.isJson ? tools::jsonText(capsule) + "\n" : capsuleText(capsule));
  return 0;
} catch (const std::system_error& error) {
  if (error.code().value() != ENOENT) throw;
  throw std::runtime_error(fmt::format(
      "{}: no such file; `mpf capsule` without a file lists the crash reports", arguments.file));
}

int listCapsules(const CapsuleArguments& arguments) {
  const auto folder =
      arguments.folder.empty() ? chooseFiles(arguments.crate).file("capsules") : arguments.folder;
  auto all = nlohmann::ordered_json::array();
  std::string lines;
  for (const auto& path : CapsuleStore(folder).list()) {
    nlohmann::ordered_json entry{{"file", path}};
    try {
      const auto capsule = readCapsule(path);
      entry["summary"] = capsuleSummary(capsule);
    } catch (const std::exception& error) {
      entry["problem"] = error.what();
    }
    const auto& what = entry.contains("summary") ? entry["summary"] : entry["problem"];
    lines += fmt::format("{}\n  {}\n", printable(path), printable(what.get<std::string>()));
    all.push_back(std::move(entry));
  }
  if (all.empty()) lines = fmt::format("no capsules in {}\n", printable(folder));
  tools::show(arguments.isJson ? tools::jsonText(all) + "\n" : lines);
  return 0;
}

}  // namespace

void addCapsule(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "capsule", "Shows the crash report of a process; without a file, lists them");
  auto arguments = std::make_shared<CapsuleArguments>();
  auto* const file = command.add_option("file", arguments->file,
                                        "Path of a crash report, as `mpf capsule` lists it");
  command.add_option("--folder", arguments->folder, "List the capsules of this folder")
      ->excludes(file);
  command.add_flag("--json", arguments->isJson, "Print JSON, for programs");
  addCrateOption(command, arguments->crate);
  command.callback([arguments, &run] {
    run = [arguments] {
      return arguments->file.empty() ? listCapsules(*arguments) : showCapsule(*arguments);
    };
  });
}

}  // namespace mpf::crate
