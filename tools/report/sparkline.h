// SPDX-License-Identifier: MIT
// Sparkline: a histogram as one line of blocks, from the first bucket with samples to the last.
#pragma once

#include <string>

#include "tools/report/snapshot.h"

namespace mpf::tools {

// "512 ns ▁▂█▅▁▁ 5120 ns": four blocks for each power of two, or two or one when four do not fit
// into `columns`. The height of a block is its count relative to the largest count. Empty without
// samples.
[[nodiscard]] std::string sparkline(const Latencies& latencies, std::size_t columns);

}  // namespace mpf::tools
