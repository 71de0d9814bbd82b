// SPDX-License-Identifier: MIT
// CoreFile: the core that the kernel wrote when a process died: the signal with its reason, and the
// stacks of the threads.
//
//   /proc/sys/kernel/core_pattern ─► findCore() ─► describeCore() in a child process ─► JSON
//
// A child process reads the core, because a damaged core must not harm the supervisor, and because
// large programs take long: after the time limit the child is killed.
//
// Threads  the process must have one thread: it forks.
// Trust    the core may contain anything: a problem with it becomes the text "problem".
// Source   core(5); libdwfl of elfutils (docs/decisions/0023-stacks-of-cores.md).
#pragma once

#include <sys/types.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

namespace mpf::crate {

struct DeadProcess {
  pid_t pid = 0;
  std::string folder;  // its working folder
};

// The pattern of files among which the core of the process is, for glob().
//   corePattern, usesPid  the files core_pattern and core_uses_pid of /proc/sys/kernel
//   returns               empty: the kernel hands cores to a program
[[nodiscard]] std::string corePathPattern(const std::string& corePattern, bool usesPid,
                                          const DeadProcess& process);

// For a process whose status says that it has left a core (WCOREDUMP):
// {"file", "code", "address", "threads": [{"tid", "frames": [{"function", "at", "module"}]}]}, or
// {"problem"} in words. The first thread is the one that received the signal.
//   code, address  si_code and si_addr of the signal
//   at             source file and line, where the program has debug information
[[nodiscard]] nlohmann::ordered_json describeCore(const DeadProcess& process,
                                                  std::chrono::milliseconds limit);

}  // namespace mpf::crate
