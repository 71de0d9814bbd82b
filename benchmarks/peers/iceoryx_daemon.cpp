// SPDX-License-Identifier: MIT
#include "benchmarks/peers/iceoryx_daemon.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "benchmarks/peers/iceoryx_files.h"

namespace mpf::bench {
namespace {

constexpr const char* kTemporary = "/tmp";  // iceoryx uses this folder even if $TMPDIR is another

// As little shared memory as the measurements need.
constexpr std::string_view kPools = R"([general]
version = 1

[[segment]]

[[segment.mempool]]
size = 128
count = 4096

[[segment.mempool]]
size = 2048
count = 256

[[segment.mempool]]
size = 66560
count = 64

[[segment.mempool]]
size = 1049600
count = 32
)";

std::string writeConfig() {
  std::string path = "/tmp/mpf-bench-roudi-" + std::string(6, 'X');
  const FileDescriptor file(checkCall(::mkostemp(path.data(), O_CLOEXEC), "mkostemp", path));
  if (::write(file.get(), kPools.data(), kPools.size()) != static_cast<ssize_t>(kPools.size()))
    throwSystemError(EIO, "write", path);
  return path;
}

// Reads the daemon's output until it reports that it is ready.
bool isReady(int pipe) {
  std::string said;
  const auto deadline = Deadline::after(std::chrono::seconds(10));
  while (!deadline.hasPassed()) {
    pollfd fd{pipe, POLLIN, 0};
    if (::poll(&fd, 1, 100) <= 0) continue;
    char text[512];
    const auto got = ::read(pipe, text, sizeof text);
    if (got <= 0) return false;
    said.append(text, static_cast<std::size_t>(got));
    if (said.find("ready for clients") != std::string::npos) return true;
  }
  return false;
}

}  // namespace

IceoryxDaemon::IceoryxDaemon() : config_(writeConfig()) {
  removeIceoryxFiles(kTemporary);  // of runs that were interrupted
  int ends[2];
  checkCall(::pipe2(ends, 0), "pipe2");
  const FileDescriptor read(ends[0]);
  FileDescriptor write(ends[1]);
  pid_ = forkProcess([&] {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);  // removes its shared memory when the runner is killed
    ::dup2(write.get(), STDOUT_FILENO);
    ::dup2(write.get(), STDERR_FILENO);
    ::execlp("iox-roudi", "iox-roudi", "-c", config_.c_str(), "-m", "off", "-l", "error",
             static_cast<char*>(nullptr));
    std::_Exit(127);
  });
  write.reset();
  if (isReady(read.get())) return;
  const bool ended = hasEnded(pid_);
  if (ended) pid_ = 0;
  stop();
  throw std::runtime_error(
      ended ? "iox-roudi ended at once: it is not installed (package iceoryx), or another one is "
              "running"
            : "iox-roudi is not ready after 10 s");
}

IceoryxDaemon::~IceoryxDaemon() { stop(); }

void IceoryxDaemon::stop() noexcept {
  ::unlink(config_.c_str());
  if (pid_ <= 0) return;
  ::kill(pid_, SIGTERM);
  const bool ended = waitUntil([this] { return hasEnded(pid_); }, std::chrono::seconds(3));
  if (!ended) killProcess(pid_);
  removeRouDiFiles(kTemporary, "/dev/shm");
  removeIceoryxFiles(kTemporary);
  pid_ = 0;
}

}  // namespace mpf::bench
