// SPDX-License-Identifier: MIT
// ProgramCheck: runs a program of MPF with --check, which checks its arguments, opens no device,
// and ends.
//
//   ProgramCheck check(plan);          // several run at the same time
//   const auto lines = check.errors(); // empty: the program accepts its arguments
//
// Threads  one.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "crate/config/process_plan.h"

namespace mpf::crate {

class ProgramCheck {
 public:
  //   throws  std::system_error
  explicit ProgramCheck(const ProcessPlan& plan);
  ProgramCheck(ProgramCheck&& other) noexcept;
  ProgramCheck& operator=(ProgramCheck&&) = delete;
  ~ProgramCheck();

  // Waits for the end of the program, and returns the lines that it printed to stderr if it refuses
  // its arguments. A program that has not ended at the deadline is killed; it counts as one that
  // accepts them, so that a slow host does not keep a crate from starting.
  [[nodiscard]] std::vector<std::string> errors(const Deadline& deadline);

 private:
  std::string program_;  // without its folder
  pid_t pid_ = 0;
  FileDescriptor output_;
};

}  // namespace mpf::crate
