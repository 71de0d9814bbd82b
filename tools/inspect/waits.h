// SPDX-License-Identifier: MIT
// Waits: who waits for whom on a link, in words, from a look at both of its windows.
//
//   "3 requests wait for the server (asleep on its futex, ready bit set)"     "the client waits for
//   1 reply"     "idle"
//
// Threads  one.
// Trust    words of two processes are not one moment: a system that runs may be a step further than
//          they say.
#pragma once

#include <string>

#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

inline constexpr const char* kIdle = "idle";
[[nodiscard]] std::string waitsOf(const SnapshotDelta& delta, const LinkView& link);

}  // namespace mpf::tools
