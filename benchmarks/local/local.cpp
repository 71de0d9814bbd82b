// SPDX-License-Identifier: MIT
#include "benchmarks/local/local.h"

#include <unistd.h>

#include "benchmarks/local/report.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

// In a full run every row is taken beside its floor; in a quick run only the MPF rows are.
int roundsOf(const Measurement& row, bool quick) {
  if (row.floorName.empty()) return 0;
  if (quick) return row.name.starts_with(kMpf) ? 1 : 0;
  return row.isSlow ? 1 : 3;
}

}  // namespace

int runLocal(const Options& options) {
  const Pace pace{std::chrono::milliseconds(400), std::chrono::seconds(12),
                  [&](const Measurement& row) { return roundsOf(row, options.quick); }};
  return run(catalogue(kRunPrefix + std::to_string(::getpid())), place(options, false), options,
             pace, [](const auto& results) { return table(results) + goals(results); });
}

}  // namespace mpf::bench
