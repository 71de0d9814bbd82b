// SPDX-License-Identifier: MIT
#include <mpf/tools/sparkline.h>

#include <algorithm>
#include <fmt/format.h>

#include <mpf/base/duration_text.h>
#include <mpf/shm/histogram.h>

namespace mpf::tools {

std::string sparkline(const Latencies& latencies) {
  static constexpr std::array<const char*, 9> kBlocks = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  if (latencies.count == 0) return {};
  const auto& buckets = latencies.buckets;
  const auto isFull = [](std::uint64_t count) { return count != 0; };
  const auto first = std::ranges::find_if(buckets, isFull) - buckets.begin();
  const auto last = std::find_if(buckets.rbegin(), buckets.rend(), isFull).base() - buckets.begin();
  const auto most = *std::ranges::max_element(buckets);

  std::string blocks;
  for (auto i = first; i < last; ++i) {
    const auto count = buckets[static_cast<std::size_t>(i)];
    blocks += kBlocks[count == 0 ? 0 : 1 + static_cast<std::size_t>(static_cast<double>(count) / static_cast<double>(most) * 7)];
  }
  const auto startNs = first == 0 ? 0 : HistogramBuckets::endNs(static_cast<std::uint32_t>(first) - 1);
  return fmt::format("{} {} {}", durationText(static_cast<double>(startNs)), blocks,
                     durationText(static_cast<double>(HistogramBuckets::endNs(static_cast<std::uint32_t>(last) - 1))));
}

}  // namespace mpf::tools
