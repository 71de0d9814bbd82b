// SPDX-License-Identifier: MIT
// whyUnreachable(): why clients cannot reach a server on another host, as far as the routers of the
// backplane tell. connectionHint(): what is known about a server without a connection.
//
// Threads  any.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tools/report/snapshot.h"

namespace mpf::tools {

// Empty: the server has a window on this host, or `location` is that of servers of this host.
[[nodiscard]] std::string whyUnreachable(const Snapshot& snapshot, std::string_view server,
                                         std::int32_t location);

// What the tools append to the client's text when it is not connected, with its punctuation: that
// the server's process is stopped, whyUnreachable(), or the location at which the server runs.
[[nodiscard]] std::string connectionHint(const Snapshot& snapshot, std::string_view server,
                                         std::int32_t location);

}  // namespace mpf::tools
