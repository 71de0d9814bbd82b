// SPDX-License-Identifier: MIT
// Sparkline: a histogram as one line of blocks, from the first bucket that holds anything to the last.
#pragma once

#include <string>

#include <mpf/tools/survey.h>

namespace mpf::tools {

// "512 ns ▁▂█▅▁▁ 5120 ns": four blocks per power of two, as high as the count's share of the fullest bucket; empty without samples.
[[nodiscard]] std::string sparkline(const Latencies& latencies);

}  // namespace mpf::tools
