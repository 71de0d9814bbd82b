// SPDX-License-Identifier: MIT
// ProcessPlan: how one process of a crate is started and supervised; everything is decided.
//
// Threads  plain data.
#pragma once

#include <map>

#include "crate/config/crate.h"

namespace mpf::crate {

struct ProcessPlan {
  std::string name;
  std::vector<std::string> command;  // program and arguments
  std::map<std::string, std::string> environment;  // in addition to that of the supervisor
  std::string user;
  std::string workingFolder;
  std::string backplane;
  std::int32_t location = 0;
  std::vector<std::string> servers;  // must be bindable before the process is ready
  bool notifies = false;  // reports that it is ready
  // The files that a router or an IOC reads at its start, with a number that changes with the
  // content, so that a reload restarts it.
  std::map<std::string, std::size_t> inputs;
  std::vector<std::string> needs;
  Restart restart = kRestart;
  std::chrono::milliseconds startTime = kStartTime;
  std::chrono::milliseconds stopTime = kStopTime;
  std::chrono::milliseconds stallLimit = kStallLimit;  // 0: none
  std::chrono::milliseconds busyLimit = kBusyLimit;  // 0: none
  std::chrono::milliseconds firstPause = kFirstPause;
  std::chrono::milliseconds lastPause = kLastPause;
  int maxRestarts = kMaxRestarts;
  std::chrono::milliseconds restartWindow = kRestartWindow;

  bool operator==(const ProcessPlan&) const = default;
};

// The plans of all processes, each after those that it needs.
//   runFolder  folder for the file that connects device models
[[nodiscard]] std::vector<ProcessPlan> planProcesses(const Crate& crate,
                                                     const std::string& runFolder);

// The command line as a shell would read it, with its environment: "A=b mpf-x 'an argument'"; empty
// for the plan of a process that is no longer in the crate.
[[nodiscard]] std::string shellText(const ProcessPlan& plan);
// What else its process depends on: "user=U folder=F FILE=NUMBER", with the `inputs`.
[[nodiscard]] std::string contextText(const ProcessPlan& plan);

}  // namespace mpf::crate
