// SPDX-License-Identifier: MIT
// Reports as JSON, for `--json`. docs/tools.md describes each field.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

// {"backplane", "servers": [window...], "clients": [window...],
//  "routers": [{..., "lines": [line...]}...],
//  "waiting": [{"pid", "server", "location"}...], "problems": [text...]}
[[nodiscard]] nlohmann::json toJson(const SnapshotDelta& delta);
// One server or client window with its links.
[[nodiscard]] nlohmann::json toJson(const SnapshotDelta& delta, const WindowView& window);

}  // namespace mpf::tools
