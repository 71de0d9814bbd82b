// SPDX-License-Identifier: MIT
// Histograms in shared memory: counts durations in buckets.
//
// Threads  record(): one; recordFromAnyThread(): any. Any thread of any process reads.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "shm/layout.h"

namespace mpf {

// Adds to a counter that only this thread writes, without a locked instruction.
inline void count(layout::Word64& counter, std::uint64_t by = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

struct HistogramBuckets {
  // Bucket 0 covers 0 to 20 ns: 16 ns and a quarter of it.
  static constexpr std::uint32_t kFirstPower = 4;

  [[nodiscard]] static std::uint32_t indexOf(std::uint64_t ns) noexcept {
    if (ns < (1u << kFirstPower)) return 0;
    const auto power = static_cast<std::uint32_t>(std::bit_width(ns)) - 1;
    const auto quarter = static_cast<std::uint32_t>(ns >> (power - 2)) & 3u;
    return std::min((power - kFirstPower) * 4 + quarter, layout::kHistogramBuckets - 1);
  }
  // The upper end of the bucket: its durations are shorter.
  [[nodiscard]] static std::uint64_t endNs(std::uint32_t index) noexcept {
    const auto power = index / 4 + kFirstPower;
    return (std::uint64_t{1} << power) + (std::uint64_t{index % 4 + 1} << (power - 2));
  }
};

inline void record(layout::Histogram& histogram, std::int64_t ns) noexcept {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0));
  count(histogram.buckets[HistogramBuckets::indexOf(value)]);
  if (value > histogram.maxNs.load(std::memory_order_relaxed))
    histogram.maxNs.store(value, std::memory_order_relaxed);
}
// As record(), for a histogram to which threads add only in this way.
inline void recordFromAnyThread(layout::Histogram& histogram, std::int64_t ns) noexcept {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0));
  histogram.buckets[HistogramBuckets::indexOf(value)].fetch_add(1, std::memory_order_relaxed);
  auto longest = histogram.maxNs.load(std::memory_order_relaxed);
  while (value > longest &&
         !histogram.maxNs.compare_exchange_weak(longest, value, std::memory_order_relaxed)) {
  }
}

}  // namespace mpf
