// SPDX-License-Identifier: MIT
#include "crate/supervisor/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <mpf/clock.h>

#include "base/process_stat.h"
#include "base/system_call.h"
#include "crate/config/process_environment.h"
#include "shm/shortage.h"

namespace mpf::crate {
namespace {

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
    reading = FileDescriptor(ends[0]);
    writing = FileDescriptor(ends[1]);
  }
  FileDescriptor reading, writing;
};

// The user of a plan; uid -1: the user of the supervisor.
struct User {
  std::string name;
  uid_t uid = static_cast<uid_t>(-1);
  gid_t gid = 0;
};

User userOf(const ProcessPlan& plan) {
  User user;
  user.name = plan.user;
  if (user.name.empty()) return user;
  const auto* const entry = ::getpwnam(user.name.c_str());  // NOLINT(concurrency-mt-unsafe)
  if (entry == nullptr) throw std::runtime_error(fmt::format("there is no user \"{}\"", user.name));
  user.gid = entry->pw_gid;
  if (entry->pw_uid != ::geteuid()) user.uid = entry->pw_uid;
  return user;
}

// Everything that the child needs, prepared before the fork: it may call only functions that are
// safe in a signal handler.
struct Image {
  Image(const ProcessPlan& plan, const std::string& notifySocket)
      : command(plan.command), environment(environmentOf(plan)) {
    if (plan.notifies) environment.push_back("NOTIFY_SOCKET=" + notifySocket);
    for (auto& word : command) arguments.push_back(word.data());
    for (auto& one : environment) variables.push_back(one.data());
    arguments.push_back(nullptr);
    variables.push_back(nullptr);
  }
  std::vector<std::string> command, environment;
  std::vector<char*> arguments, variables;
};

bool becomeUser(const User& user) {
  if (user.uid == static_cast<uid_t>(-1)) return true;
  return ::initgroups(user.name.c_str(), user.gid) == 0 && ::setgid(user.gid) == 0 &&
         ::setuid(user.uid) == 0;
}

// The child between fork and exec. Writes the errno of what failed to `failure`.
[[noreturn]] void runChild(const Image& image, const User& user, const std::string& folder, int log,
                           int gate, int failure) {
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);  // the supervisor ignores it
  ::setpgid(0, 0);  // Ctrl-C reaches the supervisor only, which stops everything in order
  char opened = 0;
  if (retryInterrupted([&] { return ::read(gate, &opened, 1); }) != 1) ::_exit(0);
  const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  if (null >= 0 && ::dup2(null, STDIN_FILENO) >= 0 && ::dup2(log, STDOUT_FILENO) >= 0 &&
      ::dup2(log, STDERR_FILENO) >= 0 && becomeUser(user) && ::chdir(folder.c_str()) == 0)
    ::execvpe(image.arguments[0], image.arguments.data(), image.variables.data());
  const int why = errno;
  [[maybe_unused]] const auto written = ::write(failure, &why, sizeof why);
  ::_exit(127);
}

}  // namespace

ChildProcess::ChildProcess(const ProcessPlan& plan, const std::string& log,
                           const std::string& notifySocket) {
  Pipe gate;
  Pipe failure;
  checkCall(::fcntl(failure.reading.get(), F_SETFL, O_NONBLOCK), "fcntl");
  const FileDescriptor logFile(
      checkCall(::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600), "open", log));
  const auto user = userOf(plan);
  const Image image(plan, notifySocket);
  const auto folder = plan.workingFolder.empty() ? std::string(".") : plan.workingFolder;
  // NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer): after what it needs
  pid_ = checkCall(::fork(), "fork");
  if (pid_ == 0) {
    gate.writing.reset();
    runChild(image, user, folder, logFile.get(), gate.reading.get(), failure.writing.get());
  }
  startTicks_ = startTicksOf(pid_);
  gate_ = std::move(gate.writing);
  failure_ = std::move(failure.reading);
}

void ChildProcess::open() {
  const char opened = 1;
  checkCall(retryInterrupted([&] { return ::write(gate_.get(), &opened, 1); }), "write", "gate");
  gate_.reset();
}

std::optional<std::string> ChildProcess::tryResult() const {
  int why = 0;
  const auto length = retryInterrupted([&] { return ::read(failure_.get(), &why, sizeof why); });
  if (length < 0 && errno == EAGAIN) return std::nullopt;
  return length == sizeof why ? std::string(std::strerror(why)) : std::string();
}

std::optional<pid_t> endedChild() {
  siginfo_t ended{};
  if (::waitid(P_ALL, 0, &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid == 0) return {};
  return ended.si_pid;
}

FileDescriptor openPidfd(pid_t pid) {
  return FileDescriptor(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
}

void sendSignal(pid_t pid, const FileDescriptor& pidfd, int number) {
  if (pidfd.get() < 0) ::kill(pid, number);
  else ::syscall(SYS_pidfd_send_signal, pidfd.get(), number, nullptr, 0);
}

std::uint64_t startTicksOf(pid_t pid) {
  const auto stat = ProcessStat::tryRead(pid);
  if (stat) return stat->hasEnded() ? 0 : stat->number(ProcessStat::kStartTicks);
  const std::system_error error(errno, std::generic_category(),
                                fmt::format("read /proc/{}/stat", pid));
  // NOLINTNEXTLINE(misc-throw-by-value-catch-by-reference): examined before
  if (shortageOf(error) != layout::Shortage::none) throw error;
  return 0;  // a process that /proc hides belongs to another user, so it is not ours
}

std::int64_t startNsOf(std::uint64_t startTicks) {
  timespec sinceBoot{};
  ::clock_gettime(CLOCK_BOOTTIME, &sinceBoot);
  const auto ticksPerSecond = static_cast<std::uint64_t>(::sysconf(_SC_CLK_TCK));
  const auto startNs = static_cast<std::int64_t>(startTicks * (1'000'000'000 / ticksPerSecond));
  return Clock::nowNs() - (sinceBoot.tv_sec * 1'000'000'000 + sinceBoot.tv_nsec - startNs);
}

}  // namespace mpf::crate
