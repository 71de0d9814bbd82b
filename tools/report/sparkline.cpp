// SPDX-License-Identifier: MIT
#include "tools/report/sparkline.h"

#include <algorithm>
#include <fmt/format.h>
#include <vector>

#include "base/duration_text.h"
#include "shm/histogram.h"

namespace mpf::tools {

namespace {

constexpr std::size_t kEnds = 22;  // columns of the times at both ends

// Each count is the sum of one or more buckets.
struct Blocks {
  std::vector<std::uint64_t> counts;
  std::uint32_t first = 0;  // bucket
  std::uint32_t end = 0;    // bucket after the last
};

Blocks blocksOf(const Latencies& latencies, std::uint32_t each) {
  Blocks blocks;
  for (std::uint32_t bucket = 0; bucket < latencies.buckets.size(); bucket += each) {
    std::uint64_t count = 0;
    for (auto i = bucket; i < bucket + each; ++i) count += latencies.buckets[i];
    if (blocks.counts.empty() && count == 0) continue;
    if (blocks.counts.empty()) blocks.first = bucket;
    blocks.counts.push_back(count);
    if (count != 0) blocks.end = bucket + each;
  }
  blocks.counts.resize((blocks.end - blocks.first) / each);
  return blocks;
}

}  // namespace

std::string sparkline(const Latencies& latencies, std::size_t columns) {
  static constexpr std::array<const char*, 9> kBlocks = {" ", "▁", "▂", "▃", "▄",
                                                         "▅", "▆", "▇", "█"};
  if (latencies.count == 0) return {};
  auto blocks = blocksOf(latencies, 1);
  for (std::uint32_t each = 2; each <= 4 && blocks.counts.size() + kEnds > columns; each *= 2)
    blocks = blocksOf(latencies, each);
  const auto most = *std::ranges::max_element(blocks.counts);
  std::string line;
  for (const auto count : blocks.counts) {
    line += kBlocks[count == 0 ? 0
                               : 1 + static_cast<std::size_t>(static_cast<double>(count) /
                                                              static_cast<double>(most) * 7)];
  }
  const auto startNs = blocks.first == 0 ? 0 : HistogramBuckets::endNs(blocks.first - 1);
  return fmt::format("{} {} {}", durationText(static_cast<double>(startNs)), line,
                     durationText(static_cast<double>(HistogramBuckets::endNs(blocks.end - 1))));
}

}  // namespace mpf::tools
