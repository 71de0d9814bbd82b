// SPDX-License-Identifier: MIT
// CrateState: the processes that a supervisor has started, in a file, so that another supervisor
// can take them over.
//
//   state.json  {"boot": ID, "crate": FILE, "processes": [{"name", "pid", "startTicks", ...}]}
//
// Threads  one.
// Crash    the file is replaced as a whole: a reader finds the old or the new state. On a full disk
//          it is overwritten, in the blocks that it has.
// Trust    a file that cannot be read, or of another boot, counts as empty.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace mpf::crate {

struct RecordedProcess {
  std::string name;
  pid_t pid = 0;
  std::uint64_t startTicks = 0;
  int restarts = 0;
  std::string command;  // printable shellText(): a process with another one is restarted
  bool isStopRequested = false;
  // Printable contextText(), with the same effect; empty in a record of an older version.
  std::string context;
};

struct CrateState {
  std::string file;  // the crate file
  std::vector<RecordedProcess> processes;

  //   throws  std::system_error without a free descriptor or memory
  [[nodiscard]] static CrateState read(const std::string& path);
  // Those of the processes that still run.
  //   throws  std::system_error without a free descriptor or memory
  [[nodiscard]] std::vector<RecordedProcess> running() const;
  //   throws  std::system_error
  void write(const std::string& path) const;
};

}  // namespace mpf::crate
