// SPDX-License-Identifier: MIT
// Summary of a backplane for `mpf inspect`: its windows, and of its links those on which somebody
// waits. However many there are, it stays a page.
//
// Threads  one.
#pragma once

#include <string>
#include <vector>

#include "tools/inspect/dissect.h"
#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

// All of it, for programs: {"backplane", "files", "bytes", "windows": [...], "links": [...],
// "problems"}.
[[nodiscard]] Tree summaryTree(const SnapshotDelta& delta);
// What a person wants to see first.
[[nodiscard]] std::string summaryText(const SnapshotDelta& delta);

// Every link of which a window is left, once.
[[nodiscard]] std::vector<const LinkView*> linksOf(const Snapshot& snapshot);
// One link in a list: {"link", "server", "client", ..., "waits"}.
[[nodiscard]] Tree linkRow(const SnapshotDelta& delta, const LinkView& link);
// Links as a table of at most so many rows; says how many more there are.
[[nodiscard]] std::string linkTable(const SnapshotDelta& delta,
                                    const std::vector<const LinkView*>& links, std::size_t most);

}  // namespace mpf::tools
