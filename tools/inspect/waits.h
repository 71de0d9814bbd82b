// SPDX-License-Identifier: MIT
// Waits: which process waits for which on a link, as text, from snapshots of its two windows.
//
//   "3 requests wait for the server (asleep on its futex, ready bit set)"
//   "the client waits for 1 reply"
//   "idle"
//
// Threads  one.
// Trust    the windows of two processes are not read at the same moment: a running system may
//          already be in a later state.
#pragma once

#include <string>

#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

inline constexpr const char* kIdle = "idle";
[[nodiscard]] std::string waitsOf(const SnapshotDelta& delta, const LinkView& link);

}  // namespace mpf::tools
