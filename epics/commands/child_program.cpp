// SPDX-License-Identifier: MIT
#include "epics/commands/child_program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <dlfcn.h>
#include <filesystem>

#include "base/system_call.h"

namespace mpf {
namespace {

namespace fs = std::filesystem;

// The library is in lib or lib/<architecture>, the programs are in bin beside it.
std::string programPath(const std::string& name) {
  Dl_info library{};
  if (::dladdr(reinterpret_cast<const void*>(&programPath), &library) == 0) return name;
  std::error_code ignored;
  const auto folder = fs::canonical(library.dli_fname, ignored).parent_path();
  for (const auto& prefix : {folder.parent_path(), folder.parent_path().parent_path()}) {
    const auto program = prefix / "bin" / name;
    if (fs::exists(program, ignored)) return program;
  }
  return name;
}

// In the child: only calls that are safe after a fork of a process with threads.
[[noreturn]] void run(pid_t parent, char* const* arguments, int output) {
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  const int input = ::open("/dev/null", O_RDONLY);
  ::dup2(input, STDIN_FILENO);
  if (output >= 0) ::dup2(output, STDOUT_FILENO);
  ::execvp(arguments[0], arguments);
  constexpr int kNotFound = 127;
  ::_exit(kNotFound);
}

}  // namespace

ChildProgram::ChildProgram(const std::string& name, std::vector<std::string> arguments,
                           int output) {
  arguments.insert(arguments.begin(), programPath(name));
  std::vector<char*> pointers;
  for (auto& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const auto parent = ::getpid();
  // NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer): after what it needs
  pid_ = checkCall(::fork(), "start", name);
  if (pid_ == 0) run(parent, pointers.data(), output);
}

ChildProgram::~ChildProgram() {
  terminate();
  wait();
}

int ChildProgram::wait() {
  // The process stays a zombie until the lock is held: terminate() never signals another process.
  siginfo_t ended{};
  retryInterrupted(
      [&] { return ::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOWAIT); });
  const std::lock_guard lock(mutex_);
  if (pid_ == 0) return status_;
  int status = 0;
  retryInterrupted([&] { return ::waitpid(pid_, &status, 0); });
  pid_ = 0;
  constexpr int kSignalled = 128;
  status_ = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
  return status_;
}

void ChildProgram::terminate() {
  const std::lock_guard lock(mutex_);
  if (pid_ != 0) ::kill(pid_, SIGTERM);
}

}  // namespace mpf
