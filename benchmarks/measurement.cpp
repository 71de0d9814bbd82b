// SPDX-License-Identifier: MIT
#include <mpf/benchmarks/measurement.h>

#include <algorithm>
#include <iterator>

namespace mpf::bench {

double costNs(const Figures& figures) noexcept {
  if (figures.typicalNs > 0) return figures.typicalNs;
  if (figures.latency.count() != 0) return static_cast<double>(figures.latency.percentileNs(50));
  return figures.perSecond > 0 ? 1e9 / figures.perSecond : 0;
}

std::vector<Measurement> catalogue(const std::string& runName) {
  auto all = floorMeasurements();
  for (auto more : {peerMeasurements(runName), scaleMeasurements(runName), tappedMeasurements(runName)}) {
    std::move(more.begin(), more.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace mpf::bench
