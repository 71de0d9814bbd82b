// SPDX-License-Identifier: MIT
// StoppedProcesses: finds out which processes a signal (SIGSTOP) or a debugger has stopped.
//
//   look({12, 13}) ── at least a second ──► look({12, 13})     contains(12): stopped all the time
//
// A process that sleeps, or that a debugger stops for moments only, is not stopped.
//
// Threads  one at a time.
#pragma once

#include <cstdint>
#include <map>
#include <set>

namespace mpf {

class StoppedProcesses {
 public:
  // Looks at these processes of our pid namespace again.
  void look(const std::set<std::int32_t>& pids);
  // Whether the process was stopped at the last two looks, and did not run between them.
  [[nodiscard]] bool contains(std::int32_t pid) const { return stopped_.contains(pid); }

 private:
  std::map<std::int32_t, std::uint64_t> ticks_;  // processor time of those that were stopped
  std::set<std::int32_t> stopped_;
};

}  // namespace mpf
