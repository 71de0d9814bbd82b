// SPDX-License-Identifier: MIT
// ServerName: names a server, at a location as clients of this host see it.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace mpf::router {

struct ServerName {
  std::int32_t location = 0;
  std::string server;
  auto operator<=>(const ServerName&) const = default;
};

}  // namespace mpf::router
