// SPDX-License-Identifier: MIT
#include "tools/torture/processes.h"

#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <exception>

#include "base/print_error.h"
#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf::torture {
namespace {

sigset_t childSignal() {
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGCHLD);
  return set;
}

// Runs an actor in the child. Ctrl-C is ignored here, because the referee handles it.
[[noreturn]] void live(const std::function<int()>& play, const sigset_t& signals) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGINT, SIG_IGN);
  ::signal(SIGTERM, SIG_IGN);
  ::pthread_sigmask(SIG_SETMASK, &signals, nullptr);
  try {
    ::_exit(play());
  } catch (const std::exception& error) {
    printError("mpf torture: a test process failed: {}\n", error.what());
    ::_exit(1);
  }
}

}  // namespace

Processes::Processes() {
  const auto set = childSignal();
  ::pthread_sigmask(SIG_BLOCK, &set, &before_);
}

Processes::~Processes() {
  killAll();
  ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void Processes::killAll() {
  for (const auto pid : running_) ::kill(pid, SIGKILL);
  while (::waitpid(-1, nullptr, __WALL) > 0) continue;
  running_.clear();
}

pid_t Processes::start(const std::function<int()>& play) {
  const auto pid = checkCall(::fork(), "fork");
  if (pid == 0) live(play, before_);
  running_.insert(pid);
  return pid;
}

pid_t Processes::startHeld(const std::function<int()>& play) {
  gate_.reset(checkCall(::eventfd(0, EFD_CLOEXEC), "eventfd"));
  return start([this, &play] {
    eventfd_t opened = 0;
    while (::eventfd_read(gate_.get(), &opened) != 0) continue;
    return play();
  });
}

void Processes::openGate() { ::eventfd_write(gate_.get(), 1); }

void Processes::handleEvents(Nanoseconds patience) {
  int status = 0;
  bool any = false;
  for (pid_t pid = 0; (pid = ::waitpid(-1, &status, __WALL | WNOHANG)) > 0; any = true) {
    const bool isTraced = tracee_ != nullptr && (pid == tracee_->pid() || !running_.contains(pid));
    if (isTraced) tracee_->handle(pid, status);
    if ((WIFEXITED(status) || WIFSIGNALED(status)) && running_.contains(pid)) noteEnd(pid, status);
  }
  if (any) return;
  const auto set = childSignal();
  const auto wait = timespecOf(patience);
  ::sigtimedwait(&set, nullptr, &wait);
}

void Processes::noteEnd(pid_t pid, int status) {
  running_.erase(pid);
  ended_[pid] = status;
}

void Processes::kill(pid_t pid) {
  if (!hasEnded(pid)) ::kill(pid, SIGKILL);
  while (!hasEnded(pid)) handleEvents(std::chrono::milliseconds(10));
  takeStatus(pid);
}

int Processes::takeStatus(pid_t pid) {
  const auto found = ended_.find(pid);
  if (found == ended_.end()) return 0;
  const auto status = found->second;
  ended_.erase(found);
  return status;
}

}  // namespace mpf::torture
