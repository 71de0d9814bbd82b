// SPDX-License-Identifier: MIT
// Program: an MPF program that runs while rows are measured, pinned to its CPUs, and its output.
//
// Threads  the runner's only thread.
// Crash    the kernel kills the program when the runner dies.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "benchmarks/stage/processes.h"

namespace mpf::bench {

class Program {
 public:
  Program() = default;
  ~Program() { stop(); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  //   words  path of the program, and its arguments
  //   enter  called in the new process before the program is executed; may be empty
  void start(std::vector<std::string> words, const Cpus& cpus, const std::function<void()>& enter);
  // Stops the program with SIGTERM, so that it can remove its segments, and kills it after 5 s.
  void stop() noexcept;

  // 0 when the program is not running.
  [[nodiscard]] int pid() const noexcept { return pid_; }
  // True also when the program was never started.
  [[nodiscard]] bool hasEnded() noexcept;
  // The output so far, stdout and stderr, and its last line.
  [[nodiscard]] std::string said() const;
  [[nodiscard]] std::string lastLine() const;

 private:
  int pid_ = 0;
  FileDescriptor said_;  // an in-memory file that receives the output
};

}  // namespace mpf::bench
