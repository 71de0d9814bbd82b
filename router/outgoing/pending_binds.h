// SPDX-License-Identifier: MIT
// PendingBinds: the servers that clients of this host wait for.
//
//   a client binds to an absent server ─► it publishes a pending bind segment ─► look()
//
// Threads  that of the event loop.
// Trust    a pending bind is ignored unless the process that owns its client's window is alive.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <mpf/backplane.h>

#include "router/server_name.h"

namespace mpf::router {

class PendingBinds {
 public:
  explicit PendingBinds(Backplane backplane) : backplane_(std::move(backplane)) {}

  // Returns the servers that are waited for now, at any location. A pending bind that an earlier
  // call has read is not read again.
  //   throws  std::system_error, for example when no file descriptor is left
  [[nodiscard]] std::set<ServerName> look();
  // The resource that the last look() lacked, so that its result is incomplete; a later call may
  // succeed. Empty: the result was complete.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  struct Known {
    ServerName name;
    std::uint64_t client = 0;  // incarnation of its window
  };
  Backplane backplane_;
  std::map<std::string, Known> known_;  // by the name of the segment
  std::string problem_;
};

}  // namespace mpf::router
