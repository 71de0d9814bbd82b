// SPDX-License-Identifier: MIT
#include "shm/process.h"

#include <poll.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <string_view>

#include "base/number.h"
#include "base/process_stat.h"
#include "shm/fork_guard.h"

namespace mpf {
namespace {

std::uint64_t startTicksIn(const std::optional<ProcessStat>& stat) noexcept {
  return stat ? stat->number(ProcessStat::kStartTicks) : 0;
}

// Start time of a process as /proc shows it, which may belong to another pid namespace. Returns 0
// if it cannot be read.
std::uint64_t startTicksOf(std::int32_t pid) noexcept {
  return startTicksIn(ProcessStat::tryRead(pid));
}

// Whether /proc shows the processes of our pid namespace.
bool isProcOurs() noexcept {
  std::array<char, 32> text{};
  const auto length = ::readlink("/proc/self", text.data(), text.size());
  return length > 0 && tryNumber<std::int32_t>(std::string_view(
                           text.data(), static_cast<std::size_t>(length))) == ::getpid();
}

std::uint64_t ownPidNamespace() {
  struct stat status{};
  return ::stat("/proc/self/ns/pid", &status) == 0 ? status.st_ino : 0;
}

// Whether a header names a process of our pid namespace.
bool isNamed(const layout::SegmentHeader& header) {
  return header.ownerPid > 0 && header.ownerStartTicks != 0 &&
         header.pidNamespace == Process::self().pidNamespace;
}

constexpr std::uint64_t kEmulatorTicks = 100;  // one second

// Whether a process is known to be in our time namespace. In another time namespace, its start time
// is a different number.
bool sharesOurClock(std::int32_t pid) noexcept {
  std::array<char, 32> path{};
  std::snprintf(path.data(), path.size(), "/proc/%d/ns/time", pid);
  struct stat own{};
  struct stat theirs{};
  return ::stat("/proc/self/ns/time", &own) == 0 && ::stat(path.data(), &theirs) == 0 &&
         own.st_ino == theirs.st_ino;
}

FileDescriptor openProcess(std::int32_t pid) {
  return FileDescriptor(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
}

// Whether the process that a header names, one of our pid namespace, has ended.
bool isGone(const layout::SegmentHeader& header) noexcept {
  const auto process = openProcess(header.ownerPid);
  if (!process) return errno == ESRCH;
  if (Process::hasEnded(process)) return true;
  const auto ticks = startTicksOf(header.ownerPid);
  // A process that reuses the pid has a later start time. The tolerance is for emulators: qemu
  // shows its program a start time that differs from the one in /proc.
  return ticks > header.ownerStartTicks + kEmulatorTicks && isProcOurs() &&
         sharesOurClock(header.ownerPid);
}

}  // namespace

const Process& Process::self() noexcept {
  // Not under a lock: another thread may hold it during a fork, and the child would wait for it.
  static thread_local ForkGuard fork;
  static thread_local Process self;
  const bool isKnown = self.pid == ::getpid() && !fork.isInherited() && self.startTicks != 0 &&
                       self.pidNamespace != 0;  // 0: /proc could not be read
  if (isKnown) return self;
  fork = ForkGuard();
  self = {::getpid(), ::getuid(), startTicksIn(ProcessStat::tryReadOwn()), ownPidNamespace(), {}};
  const std::string_view name = ::program_invocation_short_name;
  name.copy(self.program.data(), self.program.size() - 1);
  return self;
}

void Process::describe(layout::SegmentHeader& header) const noexcept {
  header.ownerPid = pid;
  header.ownerUid = uid;
  header.ownerStartTicks = startTicks;
  header.pidNamespace = pidNamespace;
  header.program = program;
}

FileDescriptor Process::openOwner(const layout::SegmentHeader& header) {
  if (!isNamed(header)) return {};
  auto descriptor = openProcess(header.ownerPid);
  // Checked after the open: if the start time matches now, the descriptor refers to the owner.
  if (descriptor && (startTicksOf(header.ownerPid) != header.ownerStartTicks || !isProcOurs()))
    descriptor.reset();
  return descriptor;
}

// A zombie (it has ended, but its parent has not waited for it) still has its pid and start time.
bool Process::hasEnded(const FileDescriptor& process) noexcept {
  pollfd ended{process.get(), POLLIN, 0};
  return ::poll(&ended, 1, 0) == 1 && (ended.revents & POLLIN) != 0;
}

// Does not rely on the namespace in self(): the child of a clone() that runs no handler of a fork
// may have the pid of its parent, in another namespace.
bool Process::hasEnded(const layout::SegmentHeader& header) noexcept {
  return isNamed(header) && isGone(header) && header.pidNamespace == ownPidNamespace();
}

}  // namespace mpf
