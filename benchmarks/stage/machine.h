// SPDX-License-Identifier: MIT
// Machine: the computer and the CPUs of a run, without which its figures mean nothing.
#pragma once

#include <string>

#include "benchmarks/stage/stage.h"

namespace mpf::bench {

struct Machine {
  std::string cpu;        // model
  std::string kernel;     // release and architecture
  std::string governor;   // of the requester's CPU; "unknown" in most virtual machines
  std::string placement;  // "CPUs 0 and 1: separate cores, one last-level cache"
  bool isVirtual = false;
  double load = 0;  // average of the last minute when the run began

  [[nodiscard]] static Machine look(const Placement& placement);
  [[nodiscard]] std::string text() const;
};

}  // namespace mpf::bench
