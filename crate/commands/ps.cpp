// SPDX-License-Identifier: MIT
// mpf ps: the processes of the crates that run. mpf logs: what a process has printed.
#include <fcntl.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <fmt/format.h>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <system_error>

#include <mpf/clock.h>

#include "base/command_line.h"
#include "base/duration_text.h"
#include "base/print_error.h"
#include "base/printable.h"
#include "base/process_stat.h"
#include "base/run_main.h"
#include "base/system_call.h"
#include "crate/commands/commands.h"
#include "crate/commands/control.h"
#include "crate/supervisor/child_process.h"
#include "crate/supervisor/control_protocol.h"
#include "crate/supervisor/crate_state.h"
#include "crate/supervisor/log_follower.h"
#include "tools/text/json_text.h"
#include "tools/text/table.h"
#include "tools/text/wrap.h"

namespace mpf::crate {
namespace {

using nlohmann::json;
using tools::jsonText;
using tools::Table;

// Processor time [s] and resident memory [bytes] of a process; zeros when it has ended.
void addUse(json& process) {
  const auto pid = process.value("pid", 0);
  const auto stat = ProcessStat::tryRead(pid).value_or(ProcessStat());
  const auto ticks = stat.number(ProcessStat::kUserTicks) + stat.number(ProcessStat::kSystemTicks);
  process["cpu_s"] = static_cast<double>(ticks) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  std::ifstream memory(fmt::format("/proc/{}/statm", pid));
  std::uint64_t size = 0, resident = 0;
  memory >> size >> resident;
  process["memory_bytes"] = resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

// What the supervisor calls ready may be stalled or busy.
std::string stateOf(const json& process) {
  std::string state = process.at("state");
  if (state != "ready") return state;
  if (process.value("is_stalled", false)) return "stalled";
  return process.contains("handling") ? "busy" : state;
}

std::string printableOf(const json& object, const char* key) {
  return printable(object.at(key).get<std::string>());
}

// "  busy: uart, server a-Serial[0], with int32 cmd=3 for 35.2 s"
std::string workOf(const json& process) {
  const auto& work = process.at("handling");
  return tools::wrap("  busy: ",
                     fmt::format("{}, server {}, with {} cmd={} for {}",
                                 printableOf(process, "name"), printableOf(work, "server"),
                                 printableOf(work, "type"), work.at("cmd").get<std::int32_t>(),
                                 durationText(work.at("for_s").get<double>() * 1e9)),
                     4);
}

void printCrate(const json& crate) {
  const auto supervisor = crate.at("pid").get<int>();
  fmt::print(
      "crate {}, {}, {}\n", printableOf(crate, "crate"), printableOf(crate, "file"),
      supervisor != 0 ? fmt::format("supervisor {}", supervisor) : printableOf(crate, "problem"));
  Table table({"PROCESS", "STATE", ">PID", ">RESTARTS", ">UP", ">CPU", ">MEMORY", "LAST END"});
  for (const auto& process : crate.at("processes")) {
    const auto pid = process.at("pid").get<int>();
    const auto isRunning = pid != 0;
    table.add(
        {printableOf(process, "name"), printableOf(process, "state"),
         isRunning ? fmt::to_string(pid) : "-", fmt::to_string(process.at("restarts").get<int>()),
         isRunning ? durationText(process.at("up_s").get<double>() * 1e9) : "-",
         isRunning ? durationText(process.at("cpu_s").get<double>() * 1e9) : "-",
         isRunning ? fmt::format("{:.1f} MB", process.at("memory_bytes").get<double>() / 1e6) : "-",
         printableOf(process, "reason")});
  }
  fmt::print("{}", table.fitted("  "));
  for (const auto& process : crate.at("processes"))
    if (process.at("state") == "busy") fmt::print("{}", workOf(process));
}

// The processes of a crate whose supervisor has ended; nothing: none runs.
std::optional<json> tryUnsupervised(const CrateFolder& folder) {
  const auto problem = textOfUnsupervised(folder);
  if (problem.empty()) return std::nullopt;
  const auto state = CrateState::read(folder.file("state.json"));
  auto processes = json::array();
  for (const auto& process : state.running()) {
    const auto upNs = Clock::nowNs() - startNsOf(process.startTicks);
    processes.push_back({{"name", process.name},
                         {"state", "unsupervised"},
                         {"pid", process.pid},
                         {"restarts", process.restarts},
                         {"up_s", static_cast<double>(upNs) / 1e9},
                         {"reason", ""},
                         {"log", folder.log(process.name)}});
  }
  return json{{"crate", folder.name()},
              {"file", state.file},
              {"folder", folder.path().string()},
              {"pid", 0},
              {"problem", problem},
              {"processes", processes}};
}

// Returns the report of a crate. A supervisor that does not reply must not hide the other crates:
// then prints why, and returns nothing.
std::optional<json> tryReport(const CrateFolder& folder) try {
  auto crate = tryUnsupervised(folder).value_or(json());
  if (crate.is_null()) crate = askSupervisor(folder, {{"do", "ps"}});
  for (auto& process : crate.at("processes")) {
    addUse(process);
    process["state"] = stateOf(process);
  }
  return crate;
} catch (const std::exception& error) {
  printError("mpf ps: {}\n", error.what());
  return std::nullopt;
}

// Whether processes of a crate run, or may run: tryReport() prints why that is not known.
bool mayRun(const CrateFolder& folder) try {
  return folder.isLocked() || !textOfUnsupervised(folder).empty();
} catch (const std::exception&) {
  return true;
}

std::vector<CrateFolder> chosenFolders(const std::string& name) {
  if (!name.empty()) return {CrateFolder::of(name)};
  auto folders = CrateFolder::all();
  std::erase_if(folders, [](const auto& folder) { return !mayRun(folder); });
  return folders;
}

int listProcesses(const std::string& name, bool isJson) {
  const auto folders = chosenFolders(name);
  auto all = json::array();
  for (const auto& folder : folders)
    if (auto crate = tryReport(folder)) all.push_back(std::move(*crate));
  if (isJson) {
    fmt::print("{}\n", jsonText(all));
  } else if (folders.empty()) {
    fmt::print("no crate is running (in {}); start one with `mpf run FILE`\n",
               CrateFolder::parent().string());
  } else {
    for (const auto& crate : all) printCrate(crate);
  }
  return all.size() == folders.size() ? 0 : kExitFailed;
}

// ---- logs

struct LogArguments {
  std::string crate, process;
  int lines = 50;
  bool follow = false;
};

// The last lines of a log; the beginning of a log may be a hole.
std::string lastLines(const std::string& text, int lines) {
  auto begin = text.size();
  for (int i = 0; i < lines && begin != 0; ++i) {
    const auto end = begin < 2 ? std::string::npos : text.rfind('\n', begin - 2);
    begin = end == std::string::npos ? 0 : end + 1;
  }
  return text.substr(std::min(text.find_first_not_of('\0', begin), text.size()));
}

// Where to continue in a log that was read up to `offset`. If it is shorter, the supervisor has
// removed whole blocks of its beginning. As few as possible are assumed, which is right if less
// than a block was not read yet; otherwise lines are left out, but none is repeated. On other file
// systems its beginning is a hole, which is left out.
std::int64_t continueAt(const FileDescriptor& file, std::int64_t offset) {
  struct stat status{};
  if (::fstat(file.get(), &status) != 0) return offset;
  if (status.st_size >= offset)
    return std::max<std::int64_t>(offset, ::lseek(file.get(), offset, SEEK_DATA));
  const auto blocks = (offset - status.st_size + kLogBlockBytes - 1) / kLogBlockBytes;
  return std::max<std::int64_t>(0, offset - blocks * kLogBlockBytes);
}

// Waits until the file may have grown. Returns false when nobody can read stdout any more.
bool tryWait(const FileDescriptor& events) {
  constexpr int kLookMs = 500;
  std::array<pollfd, 2> polled{{{events.get(), POLLIN, 0}, {STDOUT_FILENO, 0, 0}}};
  const auto longest = events ? -1 : kLookMs;
  checkCall(retryInterrupted([&] { return ::poll(polled.data(), polled.size(), longest); }),
            "poll");
  std::array<char, 4096> bytes{};
  if ((polled[0].revents & POLLIN) != 0)
    checkCall(retryInterrupted([&] { return ::read(events.get(), bytes.data(), bytes.size()); }),
              "read", "inotify");
  return (polled[1].revents & (POLLERR | POLLHUP)) == 0;
}

// Prints what is appended to the file, until a signal ends the program, or the program that reads
// stdout has ended.
//   throws  std::system_error, for example when stdout is full
void follow(const std::string& path, std::int64_t offset) {
  FileDescriptor events(::inotify_init1(IN_CLOEXEC));
  // The user has no watch left, or the file has gone; open() reports the latter.
  if (::inotify_add_watch(events.get(), path.c_str(), IN_MODIFY) < 0) events.reset();
  const FileDescriptor file(checkCall(::open(path.c_str(), O_RDONLY | O_CLOEXEC), "open", path));
  std::array<char, 65536> bytes{};
  do {
    for (;;) {
      offset = continueAt(file, offset);
      const auto length = ::pread(file.get(), bytes.data(), bytes.size(), offset);
      if (length <= 0) break;
      offset += length;
      fmt::print("{}", printableLines({bytes.data(), static_cast<std::size_t>(length)}));
    }
    if (std::fflush(stdout) != 0) throw std::system_error(errno, std::generic_category(), "write");
  } while (tryWait(events));
}

struct LogText {
  std::string text;
  std::int64_t end = 0;  // its offset in the file
};

// Reads up to `bytes` of a log from `offset` on.
std::string readFrom(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes) {
  std::string text(static_cast<std::size_t>(bytes), '\0');
  std::size_t read = 0;
  while (read < text.size()) {
    const auto at = offset + static_cast<std::int64_t>(read);
    const auto length = retryInterrupted(
        [&] { return ::pread(file.get(), text.data() + read, text.size() - read, at); });
    if (checkCall(length, "read", "the log") == 0) break;
    read += static_cast<std::size_t>(length);
  }
  text.resize(read);
  return text;
}

// Reads the end of a log with at least `lines` lines, or all of it without the hole at its
// beginning: the supervisor removes old text by punching holes, and cannot on some file systems.
LogText readLog(const std::string& path, int lines) {
  constexpr std::int64_t kFirst = 65536;
  const FileDescriptor file(checkCall(::open(path.c_str(), O_RDONLY | O_CLOEXEC), "open", path));
  LogText log;
  log.end = checkCall(::lseek(file.get(), 0, SEEK_END), "lseek", path);
  const auto data = ::lseek(file.get(), 0, SEEK_DATA);
  if (data < 0 && errno == ENXIO) return log;  // the file is empty, or a hole
  const auto begin = std::max<std::int64_t>(0, data);  // some file systems cannot seek data
  for (auto bytes = kFirst;; bytes *= 4) {
    const auto from = std::max(begin, log.end - bytes);
    log.text = readFrom(file, from, log.end - from);
    if (from == begin || std::ranges::count(log.text, '\n') > lines) return log;
  }
}

int showLog(const LogArguments& arguments) try {
  const auto path = chooseFiles(arguments.crate).log(arguments.process);
  const auto log = readLog(path, arguments.lines);
  if (!log.text.empty()) fmt::print("{}", printableLines(lastLines(log.text, arguments.lines)));
  if (arguments.follow) follow(path, log.end);
  return 0;
} catch (const std::system_error& error) {
  if (error.code().value() != ENOENT) throw;
  throw std::runtime_error(
      fmt::format("there is no log of \"{}\" in {}; `mpf ps` shows the processes that run",
                  arguments.process, chooseFiles(arguments.crate).path().string()));
}

}  // namespace

void addPs(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "ps", "Lists the processes of the crates that run, with their states and restarts");
  auto crate = std::make_shared<std::string>();
  auto isJson = std::make_shared<bool>(false);
  command.add_option("--crate", *crate, "Name of the crate; default: all that run");
  command.add_flag("--json", *isJson, "Print JSON, for programs");
  command.callback(
      [crate, isJson, &run] { run = [crate, isJson] { return listProcesses(*crate, *isJson); }; });
}

void addLogs(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("logs", "Shows what a process of a crate has printed");
  auto arguments = std::make_shared<LogArguments>();
  command.add_option("process", arguments->process, "Name of the process")->required();
  command.add_flag("-f,--follow", arguments->follow, "Also show what it prints from now on");
  command.add_option("-n,--lines", arguments->lines, "Earlier lines to show")
      ->check(wholeNumber(0, std::numeric_limits<int>::max()))
      ->capture_default_str();
  addCrateOption(command, arguments->crate);
  command.callback([arguments, &run] { run = [arguments] { return showLog(*arguments); }; });
}

}  // namespace mpf::crate
