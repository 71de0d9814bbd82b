// SPDX-License-Identifier: MIT
// whyUnreachable(): why clients cannot reach servers at a location, as far as the routers of the
// backplane tell.
//
// Threads  any.
#pragma once

#include <cstdint>
#include <string>

#include "tools/report/snapshot.h"

namespace mpf::tools {

// Empty: `location` is that of servers of this host, or nothing is known.
[[nodiscard]] std::string whyUnreachable(const Snapshot& snapshot, std::int32_t location);

}  // namespace mpf::tools
