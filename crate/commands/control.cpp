// SPDX-License-Identifier: MIT
// mpf stop, start, restart, reload: requests to the supervisor of a crate.
#include "crate/commands/control.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <memory>
#include <sstream>
#include <system_error>
#include <thread>

#include <mpf/clock.h>

#include "base/command_line.h"
#include "base/print_error.h"
#include "base/printable.h"
#include "base/run_main.h"
#include "base/time_text.h"
#include "base/whole_file.h"
#include "crate/commands/commands.h"
#include "crate/supervisor/control_protocol.h"
#include "crate/supervisor/crate_state.h"
#include "crate/supervisor/log_follower.h"
#include "tools/arguments.h"

namespace mpf::crate {
namespace {

using nlohmann::json;

struct ControlArguments {
  std::string crate;
  std::string process;
  Nanoseconds wait = std::chrono::seconds(30);
};

// The last process of this name: after a reload, those that are replaced come first until they have
// ended.
json processOf(const json& report, const std::string& name) {
  auto found = json::object();
  for (const auto& one : report.at("processes"))
    if (one.at("name") == name) found = one;
  return found;
}

// Whether a process that counts as ready is so. A program that has no servers and does not report
// counts as ready when it is started, and may end at once because its arguments are wrong.
bool isReady(const json& process) {
  constexpr double kLookS = 1;
  return process.at("state") == "ready" &&
         (process.at("notifies") == true || !process.at("servers").empty() ||
          process.at("up_s") >= kLookS);
}

// What a process that does not run printed last, with ": " in front; empty: nothing since its
// start, or it cannot be read.
std::string lastWords(const json& process) try {
  constexpr std::size_t kEnough = 65536;
  std::istringstream log(readEndOfFile(process.at("log"), kEnough).text);
  std::string last;
  for (std::string line; std::getline(log, line);) {
    if (!line.starts_with(kNotePrefix)) last = line;
    else if (line.find(" started, pid ") != std::string::npos) last.clear();
  }
  return last.empty() ? last : ": " + last;
} catch (const std::exception&) {
  return {};
}

// Sends a request to the supervisor, which has the time until the deadline to reply; but never less
// than it needs when it is busy, so that `--wait 0` sends the request without waiting for its
// result.
json ask(const CrateFolder& folder, const Deadline& deadline, const json& request) {
  constexpr std::chrono::milliseconds kLeastPatience{2000};
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline.left());
  return askSupervisor(folder, request, std::max(left, kLeastPatience));
}

// Waits until the process is in one of the states in which nothing more happens, and prints it.
//   throws  std::runtime_error when it has failed, or is in another state at the deadline
void waitFor(const CrateFolder& folder, const ControlArguments& arguments, const Deadline& deadline,
             bool isStop, int pidBefore) {
  for (;;) {
    const auto process = processOf(ask(folder, deadline, {{"do", "ps"}}), arguments.process);
    const auto state = process.value("state", "gone");
    const auto isNew = process.value("pid", 0) != pidBefore;
    if (state == "stopped" || state == "gone" || (!isStop && isNew && isReady(process))) {
      fmt::print("{} is {}\n", printable(arguments.process), state);
      return;
    }
    if (state == "failed")
      throw std::runtime_error(fmt::format("{} has failed: {}{}; see `mpf logs {}`",
                                           arguments.process, process.value("reason", ""),
                                           lastWords(process), arguments.process));
    if (deadline.hasPassed()) {
      const auto reason = process.value("reason", "");
      throw std::runtime_error(fmt::format(
          "{} is still {} after {}{}{}{}", arguments.process, state, timeText(arguments.wait),
          reason.empty() ? "" : ": ", reason, state == "pausing" ? lastWords(process) : ""));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

// Names the processes that run and need this one, which is stopped.
void printDependants(const json& report, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& one : report.at("processes")) {
    const auto needs = one.value("needs", std::vector<std::string>());
    if (one.at("pid") != 0 && std::ranges::find(needs, name) != needs.end())
      names.push_back(one.at("name"));
  }
  if (!names.empty())
    fmt::print("processes that need {} continue: {}\n", printable(name),
               printable(fmt::to_string(fmt::join(names, ", "))));
}

int controlProcess(const std::string& what, const ControlArguments& arguments) {
  const auto folder = chooseCrate(arguments.crate);
  const auto& name = arguments.process;
  const auto deadline = Deadline::after(arguments.wait);
  const auto before = processOf(ask(folder, deadline, {{"do", "ps"}}), name).value("pid", 0);
  ask(folder, deadline, {{"do", what}, {"name", name}});
  waitFor(folder, arguments, deadline, what == "stop", what == "restart" ? before : 0);
  if (what == "stop") printDependants(ask(folder, deadline, {{"do", "ps"}}), name);
  return 0;
}

int reload(ControlArguments arguments) {
  const auto folder = chooseCrate(arguments.crate);
  const auto deadline = Deadline::after(arguments.wait);
  const auto reply = ask(folder, deadline, {{"do", "reload"}});
  const auto changed = reply.value("changed", std::vector<std::string>());
  fmt::print("the crate \"{}\" is reloaded{}\n", folder.name(),
             changed.empty() ? "; no process is started or restarted" : "");
  std::fflush(stdout);
  int status = 0;
  for (const auto& name : changed) {
    arguments.process = name;
    try {
      waitFor(folder, arguments, deadline, false, 0);
    } catch (const std::runtime_error& error) {
      printError("mpf reload: {}\n", error.what());
      status = kExitFailed;
    }
  }
  return status;
}

int stopCrate(const ControlArguments& arguments) {
  const auto folder = chooseCrate(arguments.crate);
  const auto deadline = Deadline::after(arguments.wait);
  ask(folder, deadline, {{"do", "shutdown"}});
  while (folder.isLocked()) {
    if (deadline.hasPassed())
      throw std::runtime_error(
          fmt::format("the crate \"{}\" is still stopping after {}; `mpf ps` "
                      "shows which process",
                      folder.name(), timeText(arguments.wait)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (const auto text = textOfUnsupervised(folder); !text.empty()) throw std::runtime_error(text);
  fmt::print("the crate \"{}\" has stopped\n", folder.name());
  return 0;
}

// Those that run. The crate of another user, whose lock this one may not see, must not hide them:
// its error is thrown only when no crate runs that this one sees.
std::vector<CrateFolder> lockedOf(const std::vector<CrateFolder>& folders) {
  std::vector<CrateFolder> locked;
  std::exception_ptr hidden;
  for (const auto& folder : folders) {
    try {
      if (folder.isLocked()) locked.push_back(folder);
    } catch (const std::system_error&) {
      hidden = std::current_exception();
    }
  }
  if (locked.empty() && hidden) std::rethrow_exception(hidden);
  return locked;
}

std::string namesOf(const std::vector<CrateFolder>& folders) {
  std::vector<std::string> names;
  for (const auto& folder : folders) names.push_back(folder.name());
  return fmt::to_string(fmt::join(names, ", "));
}

void addWait(CLI::App& command, ControlArguments& arguments) {
  addTime(command, "--wait", arguments.wait, "Longest time to wait for the result");
}

void addRequest(CLI::App& app, Run& run, const std::string& what, const char* help) {
  auto& command = *app.add_subcommand(what, help);
  auto arguments = std::make_shared<ControlArguments>();
  auto* const process = command.add_option("process", arguments->process, "Name of the process");
  if (what == "stop") process->description("Name of the process; without it, the whole crate");
  else process->required();
  addCrateOption(command, arguments->crate);
  addWait(command, *arguments);
  command.callback([arguments, what, &run] {
    run = [arguments, what] {
      return arguments->process.empty() ? stopCrate(*arguments) : controlProcess(what, *arguments);
    };
  });
}

void addReload(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "reload", "Reads the crate file again; restarts only the processes that have changed");
  auto arguments = std::make_shared<ControlArguments>();
  addCrateOption(command, arguments->crate);
  addWait(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return reload(*arguments); }; });
}

}  // namespace

void addCrateOption(CLI::App& command, std::string& crate) {
  command.add_option("--crate", crate, "Name of the crate; default: the one that runs");
}

std::string textOfUnsupervised(const CrateFolder& folder) {
  if (folder.isLocked()) return {};
  const auto state = CrateState::read(folder.file("state.json"));
  const auto running = state.running();
  if (running.empty()) return {};
  return fmt::format(
      "the supervisor of the crate \"{}\" has ended; {} of its processes {}: `mpf run {}` takes "
      "{} over",
      folder.name(), running.size(), running.size() == 1 ? "runs" : "run", state.file,
      running.size() == 1 ? "it" : "them");
}

CrateFolder chooseCrate(const std::string& name) {
  const auto all = name.empty() ? CrateFolder::all() : std::vector{CrateFolder::of(name)};
  const auto running = lockedOf(all);
  if (running.size() == 1) return running.front();
  if (running.size() > 1)
    throw std::runtime_error(fmt::format("{} crates are running; choose one with --crate: {}",
                                         running.size(), namesOf(running)));
  for (const auto& folder : all)
    if (const auto text = textOfUnsupervised(folder); !text.empty())
      throw std::runtime_error(text + "; then use this command again");
  if (!name.empty()) return all.front();  // its request says that it is not running
  throw std::runtime_error(fmt::format("no crate is running (in {}); start one with `mpf run FILE`",
                                       CrateFolder::parent().string()));
}

CrateFolder chooseFiles(const std::string& name) {
  const auto all = CrateFolder::all();
  if (!name.empty()) {
    const auto found = std::ranges::find(all, name, &CrateFolder::name);
    if (found != all.end()) return *found;
    throw std::runtime_error(fmt::format("there are no files of a crate \"{}\" in {}; there are {}",
                                         name, CrateFolder::parent().string(),
                                         all.empty() ? "none" : namesOf(all)));
  }
  const auto running = lockedOf(all);
  const auto& folders = running.empty() ? all : running;
  if (folders.size() == 1) return folders.front();
  if (folders.empty())
    throw std::runtime_error(
        fmt::format("there are no files of a crate in {}", CrateFolder::parent().string()));
  throw std::runtime_error(fmt::format(
      "{} crates {}; choose one with --crate NAME: {}", folders.size(),
      running.empty() ? "have files, and none is running" : "are running", namesOf(folders)));
}

void addControl(CLI::App& app, Run& run) {
  addRequest(app, run, "stop", "Stops a process of a crate until `mpf start`, or the whole crate");
  addRequest(app, run, "start", "Starts a process of a crate that was stopped or has failed");
  addRequest(app, run, "restart", "Restarts a process of a crate");
  addReload(app, run);
}

}  // namespace mpf::crate
