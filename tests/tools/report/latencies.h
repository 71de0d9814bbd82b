// SPDX-License-Identifier: MIT
// Makes latency histograms from samples.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <utility>

#include "shm/histogram.h"
#include "tools/report/snapshot.h"

namespace mpf::test {

// Samples: a time [ns], and how often it was measured.
inline tools::Latencies latencies(
    std::initializer_list<std::pair<std::uint64_t, std::uint64_t>> samples) {
  tools::Latencies made;
  for (const auto& [ns, count] : samples) {
    made.buckets[HistogramBuckets::indexOf(ns)] += count;
    made.count += count;
    made.maxNs = std::max(made.maxNs, ns);
  }
  return made;
}

}  // namespace mpf::test
