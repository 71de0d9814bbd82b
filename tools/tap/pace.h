// SPDX-License-Identifier: MIT
// The pace at which a recording is replayed.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mpf::tools {

// The recorded time span `ns` at `speed` times the recorded speed. Limited to 146 years in both
// directions, so that the time now can be added.
//   speed   above 0
[[nodiscard]] inline std::int64_t replayedNs(std::int64_t ns, double speed) noexcept {
  constexpr auto kMost = static_cast<double>(std::int64_t{1} << 62);
  return static_cast<std::int64_t>(std::clamp(static_cast<double>(ns) / speed, -kMost, kMost));
}

}  // namespace mpf::tools
