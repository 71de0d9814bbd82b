// SPDX-License-Identifier: MIT
// ServerName: names a server, at a location as clients of this host see it; and how far away it may
// be.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace mpf::router {

// A router offers no server that it reaches over so many connections between routers, or more.
// Locations of routers can form a cycle, on which they would otherwise announce each other's
// proxies of an ended server for ever, each proxy one hop farther than the last.
inline constexpr std::uint32_t kMaxHops = 8;

struct ServerName {
  std::int32_t location = 0;
  std::string server;
  auto operator<=>(const ServerName&) const = default;
};

}  // namespace mpf::router
