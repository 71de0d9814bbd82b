// SPDX-License-Identifier: MIT
#include "crate/config/process_plan.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <ranges>
#include <set>
#include <system_error>

#include "base/program_beside.h"
#include "base/whole_file.h"
#include "crate/config/program_kinds.h"

namespace mpf::crate {
namespace {

std::string backplaneOf(const Crate& crate) {
  if (!crate.backplane.empty()) return crate.backplane;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread changes the environment
  const char* const inherited = std::getenv("MPF_BACKPLANE");
  return inherited != nullptr && *inherited != '\0' ? inherited : "default";
}

// Adds `--carrier` for each carrier that the process uses, and the file of wires of models.
void addCarriers(const Crate& crate, const Process& process, const std::string& runFolder,
                 std::vector<std::string>& command) {
  std::set<std::string> used;
  for (const auto& module : modulesOf(process)) used.insert(module.carrier);
  bool hasModel = false;
  for (const auto& carrier : crate.carriers) {
    if (!used.contains(carrier.name)) continue;
    command.push_back(fmt::format("--carrier={}={}", carrier.name, carrier.kind));
    hasModel = hasModel || carrier.kind == "model";
  }
  if (hasModel) command.push_back(fmt::format("--wires={}/wires", runFolder));
}

void addOption(const Setting& setting, const OptionKind* option,
               std::vector<std::string>& command) {
  for (const auto& value : setting.values) {
    if (option == nullptr || !option->isFlag) {
      command.push_back(fmt::format("--{}={}", setting.key, value));
    } else if (value == "true") {
      command.push_back("--" + setting.key);
    }
  }
}

// A program of this installation need not be in PATH. Any other is found as by a shell, also one of
// a site whose name or folder begins with "mpf".
std::string pathOf(const std::string& program) {
  if (!program.starts_with("mpf") || program.find('/') != std::string::npos) return program;
  auto beside = programBeside(program);
  std::error_code error;
  return std::filesystem::exists(beside, error) ? beside : program;
}

std::vector<std::string> commandOf(const Crate& crate, const Process& process,
                                   const std::string& runFolder) {
  if (process.kind.empty()) {
    auto command = process.command;
    command.front() = pathOf(command.front());
    return command;
  }
  const auto& kind = *findKind(process.kind);
  std::vector<std::string> command{programBeside(kind.program)};
  for (const auto& key : kind.positionals) {
    const auto* const setting = process.find(key);
    if (setting != nullptr && isPositional(process, kind, key) && !setting->values.empty())
      command.push_back(setting->values.front());
  }
  for (const auto& key : kind.keys()) {
    const auto* const setting = process.find(key);
    if (setting != nullptr && !isPositional(process, kind, key))
      addOption(*setting, kind.findOption(key), command);
  }
  for (const auto& setting : crate.defaults) {
    const auto keys = kind.keys();
    if (process.find(setting.key) == nullptr && std::ranges::find(keys, setting.key) != keys.end())
      addOption(setting, nullptr, command);
  }
  if (kind.usesCarriers) addCarriers(crate, process, runFolder, command);
  if (kind.entry == Entry::ioc) command.emplace_back("--no-shell");
  command.insert(command.end(), process.command.begin(), process.command.end());
  return command;
}

// The arguments that name files: "file", "--option=file".
std::map<std::string, std::size_t> inputsOf(const ProcessPlan& plan) {
  std::map<std::string, std::size_t> inputs;
  for (const auto& word : plan.command | std::views::drop(1)) {
    const auto name = word.starts_with("--") ? word.substr(word.find('=') + 1) : word;
    const auto path = std::filesystem::path(plan.workingFolder) / name;
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) continue;
    try {
      inputs[name] = std::hash<std::string>()(readWholeFile(path));
    } catch (const std::system_error&) {
      inputs[name] = 0;  // the process itself will report it
    }
  }
  return inputs;
}

ProcessPlan planOf(const Crate& crate, const Process& process, const std::string& runFolder) {
  ProcessPlan plan;
  plan.name = process.name;
  plan.command = commandOf(crate, process, runFolder);
  plan.environment = crate.environment;
  plan.backplane = plan.environment["MPF_BACKPLANE"] = backplaneOf(crate);
  plan.location = process.location.value_or(crate.location);
  plan.environment["MPF_LOCATION"] = fmt::to_string(plan.location);
  for (const auto& [name, value] : process.environment) plan.environment[name] = value;
  plan.user = process.user.empty() ? crate.user : process.user;
  const auto folder = std::filesystem::path(crate.file).parent_path();
  plan.workingFolder = (folder / process.workingFolder).lexically_normal().string();
  const auto* const kind = findKind(process.kind);
  if (kind != nullptr && kind->entry != Entry::server) plan.inputs = inputsOf(plan);
  plan.servers = serversOf(process);
  plan.notifies = process.notifies;
  plan.needs = process.needs;
  const auto choose = [&](auto& value, auto member) {
    if (process.supervision.*member) value = *(process.supervision.*member);
    else if (crate.supervision.*member) value = *(crate.supervision.*member);
  };
  choose(plan.restart, &Supervision::restart);
  choose(plan.startTime, &Supervision::startTime);
  choose(plan.stopTime, &Supervision::stopTime);
  choose(plan.stallLimit, &Supervision::stallLimit);
  choose(plan.busyLimit, &Supervision::busyLimit);
  choose(plan.firstPause, &Supervision::firstPause);
  choose(plan.lastPause, &Supervision::lastPause);
  choose(plan.maxRestarts, &Supervision::maxRestarts);
  choose(plan.restartWindow, &Supervision::restartWindow);
  return plan;
}

std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char one : word) text += one == '\'' ? std::string(R"('\'')") : std::string(1, one);
  return text + "'";
}

}  // namespace

std::vector<ProcessPlan> planProcesses(const Crate& crate, const std::string& runFolder) {
  std::vector<ProcessPlan> plans;
  std::set<std::string> planned;
  // Each round adds the processes whose needs have been added; checkCrate() has found circles.
  while (plans.size() < crate.processes.size()) {
    const auto before = plans.size();
    for (const auto& process : crate.processes) {
      const auto isPlanned = [&](const std::string& need) { return planned.contains(need); };
      if (planned.contains(process.name) || !std::ranges::all_of(process.needs, isPlanned))
        continue;
      plans.push_back(planOf(crate, process, runFolder));
      planned.insert(process.name);
    }
    if (plans.size() == before) break;
  }
  return plans;
}

std::string shellText(const ProcessPlan& plan) {
  std::string text;
  for (const auto& [name, value] : plan.environment) text += name + "=" + quoted(value) + " ";
  for (const auto& word : plan.command) text += quoted(word) + " ";
  if (!text.empty()) text.pop_back();
  return text;
}

std::string contextText(const ProcessPlan& plan) {
  auto text = fmt::format("user={} folder={}", quoted(plan.user), quoted(plan.workingFolder));
  for (const auto& [file, number] : plan.inputs)
    text += fmt::format(" {}={}", quoted(file), number);
  return text;
}

}  // namespace mpf::crate
