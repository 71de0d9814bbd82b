// SPDX-License-Identifier: MIT
// ChildProgram: a program of this installation that runs as a child of the IOC. It gets SIGTERM
// when the thread that started it ends, however it ends.
//
//   running ── terminate(): SIGTERM ──► ending ── after kLongestEnd: SIGKILL ──► ended
//      └──────────────── exit ─────────────┴──────────────────────────────────────┘
//
// Threads  one thread constructs the object and calls wait(); terminate(): any.
// Crash    a program that is stopped or ignores SIGTERM delays the end by kLongestEnd.
// Owner    the destructor terminates the program and waits for its end.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

namespace mpf {

class ChildProgram {
 public:
  static constexpr std::chrono::seconds kLongestEnd{5};  // from SIGTERM to SIGKILL

  //   name       such as "mpf": the program in the folder bin beside the folder of this library,
  //              otherwise that in PATH
  //   arguments  without the name
  //   output     the descriptor that becomes its standard output; -1: that of the IOC
  //   throws     std::system_error if no process can be created
  ChildProgram(const std::string& name, std::vector<std::string> arguments, int output = -1);
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  // Waits for its end, after terminate() for a limited time.
  //   returns  its exit status, 128 + the number of the signal that killed it, or 127 if there is
  //            no such program
  int wait();
  void terminate();

 private:
  [[nodiscard]] bool hasEnded() const noexcept;
  // Waits until the program has ended, the descriptor `other` is readable, or the time has passed.
  //   returns  whether the program has ended
  bool waitForEnd(Deadline deadline, int other = -1) const noexcept;
  void sendSignal(int signal);
  int reap();

  FileDescriptor terminating_;  // an eventfd, readable after terminate()
  FileDescriptor process_;  // readable after the end; none: the kernel has no pidfd_open()
  std::mutex mutex_;
  pid_t pid_ = 0;  // 0: has been reaped
  int status_ = 0;
};

}  // namespace mpf
