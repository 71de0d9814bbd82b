// SPDX-License-Identifier: MIT
// Processes: the forked actors, one of which is traced. Receives the kernel's notifications about
// all of them.
//
// Threads  one, and the process may have no other, because it forks without exec.
// Crash    the actors die with this process.
#pragma once

#include <signal.h>
#include <sys/types.h>

#include <functional>
#include <map>
#include <set>

#include <mpf/clock.h>

#include "tools/torture/tracee.h"

namespace mpf::torture {

class Processes {
 public:
  Processes();
  // Kills all actors.
  ~Processes();
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  // Forks; the child calls `play` and exits with the status that it returns.
  pid_t start(const std::function<int()>& play);
  // The same, but the child waits for openGate() before it calls `play`.
  pid_t startHeld(const std::function<int()>& play);
  void openGate();
  // Passes the events of its process to `tracee` from now on; nullptr: no process is traced.
  void setTracee(Tracee* tracee) noexcept { tracee_ = tracee; }

  // Handles the events that have happened. Without any, waits for one for at most `patience`.
  void handleEvents(Nanoseconds patience);
  [[nodiscard]] bool hasEnded(pid_t pid) const { return !running_.contains(pid); }
  // Kills a process if it is running, waits for its end and discards its status.
  void kill(pid_t pid);
  void killAll();
  // Returns and discards the status, as from waitpid(), of a process that has ended.
  int takeStatus(pid_t pid);

 private:
  void noteEnd(pid_t pid, int status);
  std::set<pid_t> running_;
  std::map<pid_t, int> ended_;
  FileDescriptor gate_;
  Tracee* tracee_ = nullptr;
  sigset_t before_{};
};

}  // namespace mpf::torture
