// SPDX-License-Identifier: MIT
// ServerWatch: finds out from shared memory whether the servers of a process are bindable, and
// whether they are stalled. It only reads, so it is not on the path of any message.
//
// Threads  one.
// Trust    segments may contain anything; a segment that cannot be read counts as absent.
#pragma once

#include <sys/types.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/report/snapshot_delta.h"

namespace mpf::crate {

class ServerWatch {
 public:
  explicit ServerWatch(std::string backplane) : backplane_(std::move(backplane)) {}

  // Reads the segments again. Stalls are found by comparison with the look before.
  void look();

  // Which of these names the process `pid` does not serve at this location.
  [[nodiscard]] std::vector<std::string> notServing(pid_t pid, std::int32_t location,
                                                    const std::vector<std::string>& servers) const;
  // Whether messages or clients wait for a server of the process, and it took none since the look
  // before.
  [[nodiscard]] bool isStalled(pid_t pid) const;
  // Removes what dead processes left on the backplane.
  void removeFilesOfDead() const;

 private:
  std::string backplane_;
  std::optional<tools::Snapshot> before_;
  std::optional<tools::Snapshot> now_;
};

}  // namespace mpf::crate
