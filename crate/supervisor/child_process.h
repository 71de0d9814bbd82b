// SPDX-License-Identifier: MIT
// ChildProcess: starts the process of a plan behind a gate, so that it is recorded before it runs.
//
//   fork ─► child waits at the gate ─► the supervisor records its pid ─► open() ─► exec ─► result
//
// Between open() and exec the child may wait long, for example for a server that has the groups of
// its user, or a folder: the supervisor does not wait for it.
//
// A supervisor that is killed before open() closes the gate with its end: the child then exits
// without having run the program. Therefore each program that runs is in the record, except while
// the record cannot be written, for example because the disk is full.
//
// Threads  the process must have one thread: it forks.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>

#include <mpf/file_descriptor.h>

#include "crate/config/process_plan.h"

namespace mpf::crate {

class ChildProcess {
 public:
  // Forks. stdout and stderr of the program are appended to the file `log`.
  //   notifySocket  NOTIFY_SOCKET of the program, if it notifies
  //   throws  std::system_error; std::runtime_error for a user that does not exist
  ChildProcess(const ProcessPlan& plan, const std::string& log,
               const std::string& notifySocket = {});

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  [[nodiscard]] std::uint64_t startTicks() const noexcept { return startTicks_; }
  // Lets the program run.
  //   throws  std::system_error
  void open();
  // Readable when tryResult() has a value.
  [[nodiscard]] int descriptor() const noexcept { return failure_.get(); }
  // Call it after open(). An empty text: the program is executed, or the child has been killed;
  // otherwise why it cannot be. nullopt: it is not known yet.
  [[nodiscard]] std::optional<std::string> tryResult() const;

 private:
  pid_t pid_ = 0;
  std::uint64_t startTicks_ = 0;
  FileDescriptor gate_;  // closes when the supervisor ends
  FileDescriptor failure_;  // errno of exec; the end of file when it succeeded
};

// A child that has ended and has not been reaped, if there is one.
[[nodiscard]] std::optional<pid_t> endedChild();

// A descriptor that becomes readable when the process ends; empty: there is no such process, or no
// descriptor is free, or the kernel has no pidfd_open().
[[nodiscard]] FileDescriptor openPidfd(pid_t pid);
// Sends a signal through the descriptor, if it is open: the process may have ended, and its pid may
// be in use again. Otherwise `pid` is a child that has not been reaped, or an adopted process
// that ran at the last look.
void sendSignal(pid_t pid, const FileDescriptor& pidfd, int number);

// The start time of a process since boot, which identifies it together with its pid; 0: there is no
// such process, /proc hides it, or it is a zombie.
//   throws  std::system_error without a free descriptor or memory
[[nodiscard]] std::uint64_t startTicksOf(pid_t pid);
// The same time as CLOCK_MONOTONIC [ns], without the times in which the host was suspended.
[[nodiscard]] std::int64_t startNsOf(std::uint64_t startTicks);

}  // namespace mpf::crate
