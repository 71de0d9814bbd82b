// SPDX-License-Identifier: MIT
#include "benchmarks/local/local.h"

#include <unistd.h>

#include "benchmarks/local/report.h"
#include "benchmarks/peers/external_peer.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

int roundsOf(const Measurement& row, bool quick) {
  return quick || row.isSlow || row.floorName.empty() ? 1 : 3;
}

}  // namespace

int runLocal(const Options& options) {
  const Pace pace{std::chrono::milliseconds(400), std::chrono::seconds(12),
                  [&](const Measurement& row) { return roundsOf(row, options.quick); }, true};
  removeFilesOfDeadRuns();
  return run(catalogue(kRunPrefix + std::to_string(::getpid())), place(options, false), options,
             pace, [](const auto& results) { return table(results) + goals(results); });
}

}  // namespace mpf::bench
