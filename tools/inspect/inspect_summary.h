// SPDX-License-Identifier: MIT
// Summary of a backplane for `mpf inspect`: its windows, and those links on which a process waits.
// The text is limited to about a page.
//
// Threads  one.
#pragma once

#include <string>
#include <vector>

#include "tools/inspect/dissect.h"
#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

// The complete summary, for programs: {"backplane", "files", "bytes", "windows": [...],
// "routers": [...], "links": [...], "problems"}.
[[nodiscard]] Tree summaryTree(const SnapshotDelta& delta);
// The summary as text, with a limited number of rows.
[[nodiscard]] std::string summaryText(const SnapshotDelta& delta);

// Each link that has at least one window, once.
[[nodiscard]] std::vector<const LinkView*> linksOf(const Snapshot& snapshot);
// One link in a list: {"link", "server", "client", ..., "waits"}.
[[nodiscard]] Tree linkRow(const SnapshotDelta& delta, const LinkView& link);
// Links as a list of at most `most` entries, with the number of the links that are left out.
[[nodiscard]] std::string linkTable(const SnapshotDelta& delta,
                                    const std::vector<const LinkView*>& links, std::size_t most);

}  // namespace mpf::tools
