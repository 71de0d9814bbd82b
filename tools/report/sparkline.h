// SPDX-License-Identifier: MIT
// Sparkline: a histogram as one line of blocks, from the first bucket that holds anything to the
// last.
#pragma once

#include <string>

#include "tools/report/snapshot.h"

namespace mpf::tools {

// "512 ns ▁▂█▅▁▁ 5120 ns": four blocks per power of two, or two or one when there is no room for
// more in so many columns, as high as the count's share of the fullest; empty without samples.
[[nodiscard]] std::string sparkline(const Latencies& latencies, std::size_t columns);

}  // namespace mpf::tools
