// SPDX-License-Identifier: MIT
#include "benchmarks/local/local.h"

#include <unistd.h>

#include <algorithm>

#include "benchmarks/local/report.h"
#include "benchmarks/peers/external_peer.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

int roundsOf(const Measurement& row, bool quick) {
  return quick || row.isSlow || row.floorName.empty() ? 1 : 3;
}

// Times a cache line. A quick run has only one round, which counts in any case.
std::optional<Measurement> lineOf(const std::vector<Measurement>& rows, bool quick) {
  if (quick) return std::nullopt;
  return *std::ranges::find(rows, kBounce, &Measurement::name);
}

}  // namespace

int runLocal(const Options& options) {
  auto rows = catalogue(kRunPrefix + std::to_string(::getpid()));
  const Pace pace{std::chrono::milliseconds(400), std::chrono::seconds(12),
                  [&](const Measurement& row) { return roundsOf(row, options.quick); }, true,
                  lineOf(rows, options.quick)};
  removeFilesOfDeadRuns();
  return run(std::move(rows), place(options, false), options, pace,
             [](const auto& results) { return table(results) + goals(results); });
}

}  // namespace mpf::bench
