// SPDX-License-Identifier: MIT
// ServerWatch: finds out from shared memory whether the servers of a process are bindable, and
// whether they are stalled or busy. It only reads, so it is not on the path of any message.
//
// Threads  one.
// Trust    segments may contain anything; a segment that cannot be read counts as absent.
#pragma once

#include <sys/types.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "crate/supervisor/service.h"
#include "tools/report/snapshot_delta.h"

namespace mpf::crate {

class ServerWatch {
 public:
  explicit ServerWatch(std::string backplane) : backplane_(std::move(backplane)) {}

  // Reads the segments again. Stalls and work are found by comparison with the looks before.
  void look();

  // Which of these names the process `pid` does not serve at this location.
  [[nodiscard]] std::vector<std::string> notServing(pid_t pid, std::int32_t location,
                                                    const std::vector<std::string>& servers) const;
  // Whether messages or clients wait for a server of the process, and it took none since the look
  // before.
  [[nodiscard]] bool isStalled(pid_t pid) const;
  // The request on which a server of the process has worked longest; nullopt: on none during two
  // looks. The time in which the process was stopped does not count.
  [[nodiscard]] std::optional<Work> workOf(pid_t pid) const;
  // Removes what dead processes left on the backplane.
  void removeFilesOfDead() const;

 private:
  // A request that a server works on, as it was first seen.
  struct Begin {
    std::uint64_t received = 0;  // by the server; another number is another request
    std::int64_t atNs = 0;
  };
  std::string backplane_;
  std::optional<tools::Snapshot> before_;
  std::optional<tools::Snapshot> now_;
  std::map<std::uint64_t, Begin> begins_;  // by the incarnation of the server
};

}  // namespace mpf::crate
