// SPDX-License-Identifier: MIT
// mpf stop, start, restart, reload: requests to the supervisor of a crate.
#include "crate/commands/control.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <memory>
#include <thread>

#include <mpf/clock.h>

#include "crate/commands/commands.h"
#include "crate/supervisor/control_protocol.h"
#include "tools/arguments.h"

namespace mpf::crate {
namespace {

using nlohmann::json;

struct ControlArguments {
  std::string crate;
  std::string process;
  Nanoseconds wait = std::chrono::seconds(30);
};

json processOf(const json& report, const std::string& name) {
  for (const auto& one : report.at("processes"))
    if (one.at("name") == name) return one;
  return json::object();
}

// Waits until the process is in one of the states in which nothing more happens.
int waitFor(const CrateFolder& folder, const ControlArguments& arguments, bool isStop,
            int pidBefore) {
  const auto deadline = Deadline::after(arguments.wait);
  for (;;) {
    const auto process = processOf(askSupervisor(folder, {{"do", "ps"}}), arguments.process);
    const auto state = process.value("state", "gone");
    const auto isNew = process.value("pid", 0) != pidBefore;
    if (state == "stopped" || state == "gone" || (!isStop && state == "ready" && isNew)) {
      fmt::print("{} is {}\n", arguments.process, state);
      return 0;
    }
    if (state == "failed")
      throw std::runtime_error(fmt::format("{} has failed: {}; see `mpf logs {}`",
                                           arguments.process, process.value("reason", ""),
                                           arguments.process));
    if (deadline.hasPassed())
      throw std::runtime_error(fmt::format("{} is still {} after {}", arguments.process, state,
                                           timeText(arguments.wait)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

int controlProcess(const std::string& what, const ControlArguments& arguments) {
  const auto folder = chooseCrate(arguments.crate);
  const auto before = processOf(askSupervisor(folder, {{"do", "ps"}}), arguments.process);
  askSupervisor(folder, {{"do", what}, {"name", arguments.process}});
  return waitFor(folder, arguments, what == "stop", what == "restart" ? before.value("pid", 0) : 0);
}

int stopCrate(const ControlArguments& arguments) {
  const auto folder = chooseCrate(arguments.crate);
  askSupervisor(folder, {{"do", "shutdown"}});
  const auto deadline = Deadline::after(arguments.wait);
  while (folder.isLocked()) {
    if (deadline.hasPassed())
      throw std::runtime_error(
          fmt::format("the crate \"{}\" is still stopping after {}; `mpf ps` "
                      "shows which process",
                      folder.name(), timeText(arguments.wait)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  fmt::print("the crate \"{}\" has stopped\n", folder.name());
  return 0;
}

void addRequest(CLI::App& app, Run& run, const std::string& what, const char* help) {
  auto& command = *app.add_subcommand(what, help);
  auto arguments = std::make_shared<ControlArguments>();
  auto* const process = command.add_option("process", arguments->process, "Name of the process");
  if (what == "stop") process->description("Name of the process; without it, the whole crate");
  else process->required();
  addCrateOption(command, arguments->crate);
  addTime(command, "--wait", arguments->wait, "Longest time to wait for the result");
  command.callback([arguments, what, &run] {
    run = [arguments, what] {
      return arguments->process.empty() ? stopCrate(*arguments) : controlProcess(what, *arguments);
    };
  });
}

void addReload(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "reload", "Reads the crate file again; restarts only the processes that have changed");
  auto crate = std::make_shared<std::string>();
  addCrateOption(command, *crate);
  command.callback([crate, &run] {
    run = [crate] {
      const auto folder = chooseCrate(*crate);
      askSupervisor(folder, {{"do", "reload"}});
      fmt::print("the crate \"{}\" is reloaded; `mpf ps` shows its processes\n", folder.name());
      return 0;
    };
  });
}

}  // namespace

void addCrateOption(CLI::App& command, std::string& crate) {
  command.add_option("--crate", crate, "Name of the crate; default: the one that runs");
}

CrateFolder chooseCrate(const std::string& name) {
  if (!name.empty()) return CrateFolder::of(name);
  std::vector<CrateFolder> running;
  std::vector<std::string> names;
  for (const auto& folder : CrateFolder::all()) {
    if (!folder.isLocked()) continue;
    running.push_back(folder);
    names.push_back(folder.name());
  }
  if (running.size() == 1) return running.front();
  if (running.empty())
    throw std::runtime_error(
        fmt::format("no crate is running (in {}); start one with `mpf run FILE`",
                    CrateFolder::parent().string()));
  throw std::runtime_error(fmt::format("{} crates are running; choose one with --crate: {}",
                                       running.size(), fmt::join(names, ", ")));
}

void addControl(CLI::App& app, Run& run) {
  addRequest(app, run, "stop", "Stops a process of a crate until `mpf start`, or the whole crate");
  addRequest(app, run, "start", "Starts a process of a crate that was stopped or has failed");
  addRequest(app, run, "restart", "Restarts a process of a crate");
  addReload(app, run);
}

}  // namespace mpf::crate
