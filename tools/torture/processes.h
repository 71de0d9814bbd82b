// SPDX-License-Identifier: MIT
// Processes: the actors that are forked and the tracee among them; what the kernel tells about all
// of them comes in here.
//
// Threads  one, and the process has no other: it forks without exec.
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
  // Kills all.
  ~Processes();
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  // Forks; the child plays and ends with what it returns.
  pid_t start(const std::function<int()>& play);
  // The same, and the child waits at its beginning until it is let go.
  pid_t startHeld(const std::function<int()>& play);
  void letGo();
  // Events of it go to `tracee` from now on; nullptr: there is none.
  void setTracee(Tracee* tracee) noexcept { tracee_ = tracee; }

  // Handles what has happened, or waits until something does.
  void handleEvents(Nanoseconds patience);
  [[nodiscard]] bool hasEnded(pid_t pid) const { return !running_.contains(pid); }
  // Kills it, if it still runs, waits for its end and forgets it.
  void kill(pid_t pid);
  void killAll();
  // Of one that has ended, and is forgotten: as waitpid() tells it.
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
