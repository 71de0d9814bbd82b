// SPDX-License-Identifier: MIT
#include "benchmarks/peers/external_peer.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include <mpf/file_descriptor.h>

#include "base/number.h"
#include "base/printable.h"
#include "base/system_call.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/shared_object.h"

namespace mpf::bench {
namespace {

constexpr int kPollMs = 20;  // how soon a server's process notices that the row has ended
constexpr auto kProgramStopGrace = std::chrono::seconds(3);
enum class Side : std::size_t { server = 0, requester = 1 };

// The programs of a row, for the runner, which removes those that outlive their parents.
using Pids = std::array<std::atomic<int>, 2>;

std::optional<double> numberIn(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  const auto number = tryTakeNumber<double>(text);
  return number && *number >= 0 ? number : std::nullopt;
}

// The numbers after `key`; nullopt if the line has another key, or not exactly these numbers.
template <std::size_t count>
std::optional<std::array<double, count>> numbersAfter(std::string_view key, std::string_view line) {
  if (!line.starts_with(key)) return std::nullopt;
  line.remove_prefix(key.size());
  std::array<double, count> numbers{};
  for (auto& number : numbers) {
    const auto found = numberIn(line);
    if (!found) return std::nullopt;
    number = *found;
  }
  return line.empty() ? std::optional(numbers) : std::nullopt;
}

// One of the two programs, and its output as lines.
class ProgramProcess {
 public:
  explicit ProgramProcess(const std::vector<std::string>& words) {
    std::array<int, 2> said{}, told{};
    checkCall(::pipe2(said.data(), O_CLOEXEC), "pipe2");
    said_ = FileDescriptor(said[0]);
    FileDescriptor says(said[1]);
    checkCall(::pipe2(told.data(), O_CLOEXEC), "pipe2");
    const FileDescriptor hears(told[0]);
    told_ = FileDescriptor(told[1]);
    pid_ = startProgram(words, [&] {
      ::dup2(hears.get(), STDIN_FILENO);
      ::dup2(says.get(), STDOUT_FILENO);
      ::dup2(says.get(), STDERR_FILENO);
    });
  }
  ~ProgramProcess() { killProcess(pid_); }
  ProgramProcess(const ProgramProcess&) = delete;
  ProgramProcess& operator=(const ProgramProcess&) = delete;

  [[nodiscard]] int pid() const noexcept { return pid_; }
  // The program ends when its standard input does.
  void askToEnd() noexcept { told_.reset(); }

  // Waits for output for a moment, and calls `take` for each line. Returns false at the end of the
  // output.
  template <class Take>
  bool readLines(const Take& take) {
    pollfd ready{said_.get(), POLLIN, 0};
    if (::poll(&ready, 1, kPollMs) <= 0) return true;
    std::array<char, 65536> bytes;
    const auto got = ::read(said_.get(), bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) return true;
    if (got <= 0) return false;
    unread_.append(bytes.data(), static_cast<std::size_t>(got));
    std::size_t begin = 0;
    for (auto end = unread_.find('\n'); end != std::string::npos;
         begin = end + 1, end = unread_.find('\n', begin))
      take(std::string_view(unread_).substr(begin, end - begin));
    unread_.erase(0, begin);
    return true;
  }

  // Waits for the end of the program. Returns what went wrong; empty after success.
  [[nodiscard]] std::string ending() {
    int status = 0;
    retryInterrupted([&] { return ::waitpid(pid_, &status, 0); });
    pid_ = 0;
    if (WIFSIGNALED(status)) return "was killed by signal " + std::to_string(WTERMSIG(status));
    if (WEXITSTATUS(status) == kNoSuchProgram) return "could not be executed";
    return WEXITSTATUS(status) == 0 ? ""
                                    : "ended with status " + std::to_string(WEXITSTATUS(status));
  }

 private:
  int pid_ = 0;
  FileDescriptor said_;
  FileDescriptor told_;
  std::string unread_;
};

std::string because(const std::string& what, const std::string& lastWords) {
  return lastWords.empty() ? what : what + ": " + printable(lastWords);
}

// Follows a program until it ends. Throws std::runtime_error if it fails.
void follow(const RunContext& context, Side side, const std::vector<std::string>& words,
            Pids& pids) {
  ProgramProcess program(words);
  pids[static_cast<std::size_t>(side)].store(program.pid(), std::memory_order_relaxed);
  std::string lastWords;
  bool hasFigures = false;
  const auto take = [&](std::string_view line) {
    if (side == Side::server && line == "ready") {
      context.ready();
    } else if (side == Side::requester && applyReport(line, context.figures())) {
      hasFigures = true;
    } else {
      lastWords = line;
    }
  };
  while (program.readLines(take)) {
    if (side == Side::server && context.stopping()) program.askToEnd();
  }
  const bool wasAsked = side == Side::server && context.stopping();
  auto failed = program.ending();
  if (wasAsked) return;
  if (failed.empty() && side == Side::server) failed = "ended before it was asked to";
  if (failed.empty() && !hasFigures) failed = "reported no figures";
  if (!failed.empty()) throw std::runtime_error(because(words.front() + " " + failed, lastWords));
}

std::vector<std::string> commandLine(const ExternalProgram& program, const char* role,
                                     const ExternalTask& task, const PeerOptions& options,
                                     Budget budget) {
  auto words = program.words;
  for (auto& word : argumentsOf(role, task, options, budget)) words.push_back(std::move(word));
  return words;
}

// Ends a program whose parent, a process of the Stage, was killed. It is a child of the runner then
// (PR_SET_CHILD_SUBREAPER), so its pid cannot be that of another process.
void endOrphan(int pid) noexcept {
  if (pid > 0 && ::waitpid(pid, nullptr, WNOHANG) == 0) killProcess(pid);
}

// The folders where programs may create files whose names begin with "NAME.".
template <class Condition>
void removeFiles(const Condition& isToBeRemoved) {
  namespace fs = std::filesystem;
  for (const char* folder : {"/dev/shm", "/tmp"}) {
    std::error_code failure;
    std::vector<fs::path> found;
    for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
         entry.increment(failure)) {
      if (isToBeRemoved(entry->path().filename().string())) found.push_back(entry->path());
    }
    for (const auto& path : found) fs::remove_all(path, failure);
  }
}

// "mpf-bench-PID-N.anything", where the process PID does not exist.
bool isOfDeadRun(std::string_view file) {
  const std::string_view prefix = kRunPrefix;
  if (!file.starts_with(prefix) || file.find('.') == std::string_view::npos) return false;
  file.remove_prefix(prefix.size());
  const auto pid = tryTakeNumber<int>(file);
  if (!pid || !file.starts_with('-') || *pid <= 0) return false;
  return ::kill(*pid, 0) != 0 && errno == ESRCH;
}

}  // namespace

bool applyReport(std::string_view line, Figures& figures) {
  if (const auto latency = numbersAfter<2>("latency ", line)) {
    const auto [ns, count] = *latency;
    figures.latency.add(static_cast<std::uint64_t>(ns), static_cast<std::uint64_t>(count));
    return true;
  }
  if (const auto typical = numbersAfter<1>("typical ", line)) {
    figures.typicalNs = typical->front();
    return true;
  }
  if (const auto rate = numbersAfter<2>("rate ", line); rate && (*rate)[1] > 0) {
    figures.count = static_cast<std::uint64_t>((*rate)[0]);
    figures.perSecond = (*rate)[0] * 1e9 / (*rate)[1];
    return true;
  }
  return false;
}

std::vector<std::string> argumentsOf(const char* role, const ExternalTask& task,
                                     const PeerOptions& options, Budget budget) {
  return {std::string("role=") + role,
          std::string("work=") + task.work,
          std::string("mode=") + toString(options.mode),
          "bytes=" + std::to_string(options.bytes),
          std::string("touch=") + (options.touch ? "1" : "0"),
          "window=" + std::to_string(task.window),
          "name=" + options.name,
          "warmUpNs=" + std::to_string(budget.warmUp.count()),
          "measureNs=" + std::to_string(budget.measure.count())};
}

void removeFilesOfDeadRuns() { removeFiles(isOfDeadRun); }

Outcome runExternal(const Stage& stage, const ExternalProgram& program, const ExternalTask& task,
                    const PeerOptions& options) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  const SharedObject<Pids> pids;
  const Budget budget{std::max(stage.budget().warmUp, program.leastWarmUp), stage.budget().measure};
  Workload workload;
  workload.grace = program.grace;
  workload.stopsByItself = true;
  workload.stopGrace = kProgramStopGrace;
  workload.server = [&](const RunContext& context) {
    follow(context, Side::server, commandLine(program, "server", task, options, budget), *pids);
  };
  workload.requester = [&](const RunContext& context) {
    follow(context, Side::requester, commandLine(program, "requester", task, options, budget),
           *pids);
    context.stop();
  };
  auto outcome = Stage(stage.placement(), budget).run(workload);
  for (const auto& pid : *pids) endOrphan(pid.load(std::memory_order_relaxed));
  removeFiles([&](const std::string& file) { return file.starts_with(options.name + "."); });
  return outcome;
}

}  // namespace mpf::bench
