// SPDX-License-Identifier: MIT
#include <mpf/shm/process.h>

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <mutex>
#include <sstream>

namespace mpf {
namespace {

// Field 22 of /proc/<pid>/stat; the program name before it may hold blanks and brackets. 0 when there is no such process.
std::uint64_t startTicksOf(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/stat");
  std::string line;
  if (!std::getline(file, line)) return 0;
  std::istringstream fields(line.substr(line.rfind(')') + 1));
  std::string skipped;
  for (int field = 3; field < 22; ++field) fields >> skipped;
  std::uint64_t ticks = 0;
  fields >> ticks;
  return ticks;
}

std::uint64_t ownPidNamespace() {
  struct stat status{};
  return ::stat("/proc/self/ns/pid", &status) == 0 ? status.st_ino : 0;
}

}  // namespace

Process Process::self() {
  static std::mutex mutex;
  static Process self;
  const std::lock_guard lock(mutex);
  if (self.pid == ::getpid()) return self;
  self.pid = ::getpid();
  self.uid = ::getuid();
  self.startTicks = startTicksOf("self");
  self.pidNamespace = ownPidNamespace();
  self.program = ::program_invocation_short_name;
  return self;
}

void Process::describe(layout::SegmentHeader& header) const {
  header.ownerPid = pid;
  header.ownerUid = uid;
  header.ownerStartTicks = startTicks;
  header.pidNamespace = pidNamespace;
  program.copy(header.program.data(), header.program.size() - 1);
}

FileDescriptor Process::openOwner(const layout::SegmentHeader& header) {
  if (header.ownerPid <= 0 || header.pidNamespace != ownPidNamespace()) return {};
  FileDescriptor descriptor(static_cast<int>(::syscall(SYS_pidfd_open, header.ownerPid, 0)));
  // Looked at after the open: if the start time is right now, the descriptor is that process's.
  if (descriptor && startTicksOf(std::to_string(header.ownerPid)) != header.ownerStartTicks) descriptor.reset();
  return descriptor;
}

}  // namespace mpf
