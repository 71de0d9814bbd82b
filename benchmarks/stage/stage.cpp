// SPDX-License-Identifier: MIT
#include "benchmarks/stage/stage.h"

#include <poll.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::bench {
namespace {

enum Role : std::size_t { server = 0, requester = 1 };

// Shared anonymous memory, populated.
class Shared {
 public:
  explicit Shared(std::size_t bytes)
      : bytes_(bytes),
        at_(::mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                   MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0)) {
    if (at_ == MAP_FAILED) throwSystemError(errno, "mmap", "benchmark memory");
  }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  ~Shared() { ::munmap(at_, bytes_); }
  [[nodiscard]] std::span<std::byte> bytes() const noexcept {
    return {static_cast<std::byte*>(at_), bytes_};
  }

 private:
  std::size_t bytes_;
  void* at_;
};

int pidFd(int pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }

// One of the two processes.
class Child {
 public:
  Child(Role role, const Cpus& cpus, Control& control, const std::function<void()>& body)
      : pid_(forkProcess([&] {
          auto& error = control.errors[role];
          try {
            pinTo(cpus);
            body();
          } catch (const std::exception& exception) {
            std::snprintf(error.data(), error.size(), "%s", exception.what());
            std::_Exit(1);
          }
        })),
        fd_(pidFd(pid_)) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() { killProcess(pid_); }
  [[nodiscard]] const FileDescriptor& fd() const noexcept { return fd_; }

  // Waits for the end of the process. Returns what went wrong; empty after success.
  [[nodiscard]] std::string ending(const char* who, const std::array<char, 240>& error) {
    int status = 0;
    if (retryInterrupted([&] { return ::waitpid(pid_, &status, 0); }) == pid_) pid_ = 0;
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
    if (error[0] != '\0') return std::string(who) + ": " + error.data();
    return std::string(who) + (WIFSIGNALED(status)
                                   ? " was killed by signal " + std::to_string(WTERMSIG(status))
                                   : " failed");
  }

 private:
  int pid_;
  FileDescriptor fd_;
};

// Why neither process has ended in time.
std::string lateness(const Control& control, Nanoseconds limit) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit).count();
  auto text = "neither process ended within " + std::to_string(seconds) + " s";
  const std::string what(control.waitsFor.data(),
                         ::strnlen(control.waitsFor.data(), control.waitsFor.size() - 1));
  if (!what.empty())
    text += "; the requester waited for " + what + ", and had got " +
            std::to_string(control.got.load(std::memory_order_relaxed));
  return text;
}

// Waits until one of the two processes ends and returns its role; nullopt when neither ends in
// time.
std::optional<Role> waitForEnd(const Child* serverChild, const Child& requesterChild,
                               Deadline deadline) {
  for (;;) {
    std::array<pollfd, 2> fds{
        pollfd{serverChild != nullptr ? serverChild->fd().get() : -1, POLLIN, 0},
        pollfd{requesterChild.fd().get(), POLLIN, 0}};
    const auto leftMs =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline.left()).count();
    const int found = ::poll(fds.data(), fds.size(), static_cast<int>(leftMs) + 1);
    if (fds[requester].revents != 0) return requester;
    if (fds[server].revents != 0) return server;
    if (found == 0 && deadline.hasPassed()) return std::nullopt;
  }
}

}  // namespace

void RunContext::ready(std::uint16_t port) const noexcept {
  control_.port.store(port, std::memory_order_relaxed);
  // PAIR(bench-ready): the requester sees everything that the server did before.
  control_.ready.store(1, std::memory_order_release);
}

void RunContext::waitsFor(std::string_view what) const noexcept {
  got(0);
  control_.waitsFor.fill('\0');
  what.copy(control_.waitsFor.data(), control_.waitsFor.size() - 1);
}

Outcome Stage::run(const Workload& workload) const {
  const Shared memory(sizeof(Control) + workload.scratchBytes + 4096);
  auto& control = *new (memory.bytes().data()) Control;
  constexpr std::size_t kScratchOffset = (sizeof(Control) + 4095) / 4096 * 4096;
  const RunContext context(control, budget_,
                           memory.bytes().subspan(std::min(kScratchOffset, memory.bytes().size()),
                                                  workload.scratchBytes));
  const auto limit = budget_.warmUp + budget_.measure + workload.grace;

  std::unique_ptr<Child> serverChild;
  if (workload.server)
    serverChild = std::make_unique<Child>(server, placement_.server, control,
                                          [&] { workload.server(context); });
  Child requesterChild(requester, placement_.requester, control, [&] {
    // PAIR(bench-ready): see RunContext::ready().
    const auto isReady = [&] { return control.ready.load(std::memory_order_acquire) != 0; };
    if (workload.server && !waitUntil(isReady, workload.grace))
      throw std::runtime_error("the server was not ready in time");
    workload.requester(context);
  });

  Outcome outcome;
  const auto first = waitForEnd(serverChild.get(), requesterChild, Deadline::after(limit));
  if (!first) {
    outcome.error = lateness(control, limit);
  } else if (*first == requester) {
    outcome.error = requesterChild.ending("requester", control.errors[requester]);
    if (serverChild && workload.stopsByItself && outcome.error.empty()) {
      pollfd end{serverChild->fd().get(), POLLIN, 0};
      const auto grace = std::chrono::duration_cast<std::chrono::milliseconds>(workload.stopGrace);
      ::poll(&end, 1, static_cast<int>(grace.count()));
    }
  } else if (outcome.error = serverChild->ending("server", control.errors[server]);
             outcome.error.empty()) {
    // The server answered the last request and ended before the requester.
    const auto second = waitForEnd(nullptr, requesterChild, Deadline::after(workload.grace));
    outcome.error = second ? requesterChild.ending("requester", control.errors[requester])
                           : "the requester did not end in time";
  }
  outcome.figures = control.figures;
  return outcome;
}

}  // namespace mpf::bench
