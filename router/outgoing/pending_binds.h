// SPDX-License-Identifier: MIT
// PendingBinds: which servers the clients of this host wait for, at the locations that a router
// reaches.
//
//   a client binds to a server that is not there ─► its pending bind segment ─► look()
//
// Threads  that of the event loop.
// Trust    a pending bind counts while its client's window has an owner.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <mpf/backplane.h>

namespace mpf::router {

struct ServerName {
  std::int32_t location = 0;
  std::string server;
  auto operator<=>(const ServerName&) const = default;
};

class PendingBinds {
 public:
  explicit PendingBinds(Backplane backplane) : backplane_(std::move(backplane)) {}

  // What is wished for now, at any location. A pending bind that was seen before is not read again.
  //   throws  std::system_error: no descriptor was left, say
  [[nodiscard]] std::set<ServerName> look();
  // Why the last look() has not seen all: there was too little of something, and the next one may
  // see more. Empty: it has.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  struct Known {
    ServerName name;
    std::uint64_t client = 0;  // incarnation of its window
  };
  Backplane backplane_;
  std::map<std::string, Known> known_;  // by segment
  std::string problem_;
};

}  // namespace mpf::router
