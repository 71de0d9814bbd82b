// SPDX-License-Identifier: MIT
#include "crate/config/program_check.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <spawn.h>
#include <sstream>
#include <utility>

#include "base/printable.h"
#include "base/system_call.h"
#include "crate/config/process_environment.h"

namespace mpf::crate {
namespace {

// The file actions and attributes of posix_spawn().
class Spawn {
 public:
  Spawn(const std::string& folder, int output) {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions_, output, STDERR_FILENO);
    ::posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
    ::posix_spawnattr_init(&attributes_);
    sigset_t none, changed;  // the supervisor blocks signals, and ignores SIGPIPE
    ::sigemptyset(&none);
    ::sigemptyset(&changed);
    ::sigaddset(&changed, SIGPIPE);
    ::posix_spawnattr_setsigmask(&attributes_, &none);
    ::posix_spawnattr_setsigdefault(&attributes_, &changed);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  Spawn(const Spawn&) = delete;
  Spawn& operator=(const Spawn&) = delete;
  ~Spawn() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }

  // Returns the errno of what failed.
  [[nodiscard]] int start(std::vector<std::string> words, std::vector<std::string> variables,
                          pid_t& pid) const {
    const auto arguments = pointersTo(words), environment = pointersTo(variables);
    return ::posix_spawn(&pid, arguments.front(), &actions_, &attributes_, arguments.data(),
                         environment.data());
  }

 private:
  static std::vector<char*> pointersTo(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (auto& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
  }

  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

// Reads until the end of the file. Returns false at the deadline.
bool readAll(int file, const Deadline& deadline, std::string& text) {
  std::array<char, 4096> bytes{};
  for (;;) {
    pollfd poll{file, POLLIN, 0};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline.left()).count();
    if (retryInterrupted([&] { return ::poll(&poll, 1, static_cast<int>(left)); }) <= 0)
      return false;
    const auto length = retryInterrupted([&] { return ::read(file, bytes.data(), bytes.size()); });
    if (length <= 0) return true;
    text.append(bytes.data(), static_cast<std::size_t>(length));
  }
}

// Removes what is around an error of a command line: "mpf-x: ERROR; `mpf-x --help` shows ...".
std::string bareError(std::string line, const std::string& program) {
  if (line.starts_with(program + ": ")) line.erase(0, program.size() + 2);
  if (const auto at = line.find(fmt::format("; `{} --help`", program)); at != std::string::npos)
    line.erase(at);
  return line;
}

}  // namespace

ProgramCheck::ProgramCheck(const ProcessPlan& plan)
    : program_(std::filesystem::path(plan.command.front()).filename().string()) {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  output_ = FileDescriptor(ends[0]);
  const FileDescriptor writing(ends[1]);
  auto command = plan.command;
  command.emplace_back("--check");
  const Spawn spawn(plan.workingFolder.empty() ? "." : plan.workingFolder, writing.get());
  if (const int why = spawn.start(command, environmentOf(plan), pid_); why != 0)
    throwSystemError(why, "posix_spawn", command.front());
}

ProgramCheck::ProgramCheck(ProgramCheck&& other) noexcept
    : program_(std::move(other.program_)),
      pid_(std::exchange(other.pid_, 0)),
      output_(std::move(other.output_)) {}

ProgramCheck::~ProgramCheck() {
  if (pid_ == 0) return;
  ::kill(pid_, SIGKILL);
  retryInterrupted([&] { return ::waitpid(pid_, nullptr, 0); });
}

std::vector<std::string> ProgramCheck::errors(const Deadline& deadline) {
  std::string text;
  if (!readAll(output_.get(), deadline, text)) return {};  // the destructor kills it
  int status = 0;
  retryInterrupted([&] { return ::waitpid(std::exchange(pid_, 0), &status, 0); });
  if (status == 0) return {};
  std::vector<std::string> lines;
  std::istringstream all(text);
  for (std::string line; std::getline(all, line);)
    if (!line.empty()) lines.push_back(bareError(printable(line), program_));
  if (lines.empty()) lines.push_back(fmt::format("{} --check failed without a text", program_));
  return lines;
}

}  // namespace mpf::crate
