// SPDX-License-Identifier: MIT
// Decides which servers of this host a peer may use: [[serve]] and [[allow]] of the configuration.
//
// Threads  any.
#pragma once

#include <cstdint>
#include <string>

#include "router/config/router_config.h"

namespace mpf::router {

// Returns the entry of [[serve]] for a location, when `peer` may use the server; nullptr: it may
// not. Without any [[allow]], all peers may use all served locations.
//   peer      the common name of the peer's certificate; empty: plain TCP
//   location  as the peer calls it
[[nodiscard]] const Serve* findAllowed(const RouterConfig& config, const std::string& peer,
                                       std::int32_t location, const std::string& server);

}  // namespace mpf::router
