// SPDX-License-Identifier: MIT
#include "tools/torture/tracee.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/user.h>
#include <sys/wait.h>

#include <cerrno>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "base/system_call.h"

namespace mpf::torture {
namespace {

#ifdef __x86_64__
constexpr bool kIsKnownProcessor = true;
constexpr char kNop = '\x90';
constexpr char kBreakpoint = '\xcc';
Marks::Address programCounter(pid_t thread) {
  user_regs_struct registers{};
  ::ptrace(PTRACE_GETREGS, thread, nullptr, &registers);
  return registers.rip;
}
#else
constexpr bool kIsKnownProcessor = false;
constexpr char kNop = 0;
constexpr char kBreakpoint = 0;
Marks::Address programCounter(pid_t) { return 0; }
#endif

constexpr long kOptions = PTRACE_O_EXITKILL | PTRACE_O_TRACECLONE;

int eventOf(int status) { return status >> 16; }

// Whether a thread stopped because it has executed a breakpoint, not because it has executed one
// instruction.
bool isBreakpoint(pid_t thread) {
  siginfo_t info{};
  return ::ptrace(PTRACE_GETSIGINFO, thread, nullptr, &info) == 0 && info.si_code == SI_KERNEL;
}

}  // namespace

Tracee::Tracee(pid_t pid, const Marks& marks) : pid_(pid), marks_(marks) {
  if (!kIsKnownProcessor)
    throw std::runtime_error("mpf torture supports breakpoints on x86-64 processors only");
  checkCall(::ptrace(PTRACE_SEIZE, pid, nullptr, kOptions), "trace",
            fmt::format("process {}", pid));
  const auto memory = fmt::format("/proc/{}/mem", pid);
  memory_.reset(checkCall(::open(memory.c_str(), O_RDWR | O_CLOEXEC), "open", memory));
}

void Tracee::patch(Marks::Address address, char instruction) const {
  checkCall(::pwrite(memory_.get(), &instruction, 1, static_cast<off_t>(address)), "write to",
            fmt::format("process {}", pid_));
}

void Tracee::watch(const std::set<std::string>& marks) {
  for (const auto& mark : marks) {
    for (const auto address : marks_.byName().at(mark)) {
      patch(address, kBreakpoint);
      patched_.push_back(address);
    }
  }
}

void Tracee::aim(Place place) {
  place_ = std::move(place);
  watch({place_.mark});
}

void Tracee::resume(pid_t thread, int signal) const noexcept {
  const auto request = thread == stepping_ ? PTRACE_SINGLESTEP : PTRACE_CONT;
  // Fails when the thread was killed; then waitpid() reports its end next.
  ::ptrace(request, thread, nullptr, static_cast<std::uintptr_t>(signal));
}

void Tracee::handle(pid_t thread, int status) {
  if (WIFEXITED(status) || WIFSIGNALED(status)) {
    if (thread == stepping_) stepping_ = 0;
    if (thread == stopped_) stopped_ = 0;
    if (thread != pid_) return;
    isGone_ = true;  // the kernel reports the main thread last
    status_ = status;
    return;
  }
  // A new thread was created; both threads report this.
  if (eventOf(status) != 0) return resume(thread);
  if (WSTOPSIG(status) != SIGTRAP) return resume(thread, WSTOPSIG(status));
  onTrap(thread);
}

void Tracee::onTrap(pid_t thread) {
  const auto* mark = isBreakpoint(thread) ? marks_.find(programCounter(thread) - 1) : nullptr;
  if (mark != nullptr) return onMark(thread, *mark);
  if (thread == stepping_) return onInstruction(thread);
  resume(thread);  // the return of a system call that was entered by a single step
}

void Tracee::onMark(pid_t thread, const std::string& mark) {
  const auto hit = ++hits_[mark];
  if (thread == stepping_) return onInstruction(thread);
  const bool aimed =
      !released_ && stepping_ == 0 && stopped_ == 0 && place_.mark == mark && place_.hit == hit;
  if (!aimed) return resume(thread);
  left_ = place_.instructions;
  stepping_ = thread;
  if (left_ == 0) return arrive(thread);
  resume(thread);
}

void Tracee::onInstruction(pid_t thread) {
  atNextMark_ = place_.upToNextMark && marks_.find(programCounter(thread)) != nullptr;
  if (--left_ == 0 || atNextMark_) return arrive(thread);
  resume(thread);
}

void Tracee::arrive(pid_t thread) noexcept {
  stepping_ = 0;
  stopped_ = thread;
}

void Tracee::kill() const noexcept { ::kill(pid_, SIGKILL); }

void Tracee::release() {
  for (const auto address : patched_) patch(address, kNop);
  released_ = true;
  if (stopped_ != 0) resume(std::exchange(stopped_, 0));
}

}  // namespace mpf::torture
