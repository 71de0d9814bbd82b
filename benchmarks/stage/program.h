// SPDX-License-Identifier: MIT
// Program: a program of ours that runs while rows are taken, pinned to its CPUs, and what it says.
//
// Threads  the runner's only one.
// Crash    it dies with the runner, by the kernel.
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

  //   words  its path, then its arguments
  //   enter  called in its process, before it begins; may be empty
  void start(std::vector<std::string> words, const Cpus& cpus, const std::function<void()>& enter);
  // With time to take its leave: what it does not remove, others have to.
  void stop() noexcept;

  // 0: it does not run.
  [[nodiscard]] int pid() const noexcept { return pid_; }
  // True also when it was never started.
  [[nodiscard]] bool hasEnded() noexcept;
  // All that it has said so far, on stdout and stderr, and the last line of it.
  [[nodiscard]] std::string said() const;
  [[nodiscard]] std::string lastLine() const;

 private:
  int pid_ = 0;
  FileDescriptor said_;  // a file in memory
};

// The path of a program of ours: beside this one.
[[nodiscard]] std::string programBeside(const std::string& name);

}  // namespace mpf::bench
