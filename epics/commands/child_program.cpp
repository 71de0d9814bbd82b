// SPDX-License-Identifier: MIT
#include "epics/commands/child_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
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
  if (input > STDERR_FILENO) ::close(input);
  if (output >= 0) ::dup2(output, STDOUT_FILENO);
  ::execvp(arguments[0], arguments);
  constexpr int kNotFound = 127;
  ::_exit(kNotFound);
}

// For poll(): rounded up.
int millisecondsOf(Nanoseconds wait) noexcept {
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(wait).count());
}

}  // namespace

ChildProgram::ChildProgram(const std::string& name, std::vector<std::string> arguments, int output)
    : terminating_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", name)) {
  arguments.insert(arguments.begin(), programPath(name));
  std::vector<char*> pointers;
  for (auto& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const auto parent = ::getpid();
  // NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer): after what it needs
  pid_ = checkCall(::fork(), "start", name);
  if (pid_ == 0) run(parent, pointers.data(), output);
  process_.reset(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
}

ChildProgram::~ChildProgram() {
  terminate();
  wait();
}

int ChildProgram::wait() {
  constexpr std::chrono::seconds kAfterKill{1};  // the kernel may be busy with a device
  if (pid_ == 0) return status_;
  if (!waitForEnd(Deadline::never(), terminating_.get()) &&
      !waitForEnd(Deadline::after(kLongestEnd))) {
    sendSignal(SIGKILL);
    waitForEnd(Deadline::after(kAfterKill));
  }
  return reap();
}

void ChildProgram::terminate() {
  sendSignal(SIGTERM);
  ::eventfd_write(terminating_.get(), 1);
}

void ChildProgram::sendSignal(int signal) {
  const std::lock_guard lock(mutex_);
  if (pid_ != 0) ::kill(pid_, signal);
}

bool ChildProgram::hasEnded() const noexcept {
  siginfo_t ended{};
  const auto id = static_cast<id_t>(pid_);
  // An error: the process ignores SIGCHLD, so the kernel has reaped the program.
  return ::waitid(P_PID, id, &ended, WEXITED | WNOWAIT | WNOHANG) < 0 || ended.si_pid != 0;
}

bool ChildProgram::waitForEnd(Deadline deadline, int other) const noexcept {
  constexpr Nanoseconds kLook = std::chrono::milliseconds(50);  // without a descriptor
  std::array<pollfd, 2> events{pollfd{.fd = process_.get(), .events = POLLIN, .revents = 0},
                               pollfd{.fd = other, .events = POLLIN, .revents = 0}};
  while (!hasEnded() && !deadline.hasPassed() && events[1].revents == 0) {
    const auto longest = process_ ? deadline.left() : std::min(kLook, deadline.left());
    const bool isUnlimited = process_ && deadline.isNever();
    ::poll(events.data(), events.size(), isUnlimited ? -1 : millisecondsOf(longest));
  }
  return hasEnded();
}

int ChildProgram::reap() {
  constexpr int kSignalled = 128;
  const std::lock_guard lock(mutex_);  // terminate() never signals another process
  int status = 0;
  const auto reaped = retryInterrupted([&] { return ::waitpid(pid_, &status, WNOHANG); });
  const bool hasExited = reaped != 0 && WIFEXITED(status);
  const int signal = reaped != 0 ? WTERMSIG(status) : SIGKILL;
  status_ = hasExited ? WEXITSTATUS(status) : kSignalled + signal;
  pid_ = 0;
  return status_;
}

}  // namespace mpf
