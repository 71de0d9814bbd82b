// SPDX-License-Identifier: MIT
#include "benchmarks/stage/measurement.h"

#include <algorithm>
#include <iterator>

namespace mpf::bench {

double costNs(const Figures& figures) noexcept {
  if (figures.perSecond > 0) return 1e9 / figures.perSecond;
  if (figures.typicalNs > 0) return figures.typicalNs;
  return static_cast<double>(figures.latency.percentileNs(50));
}

std::vector<Measurement> catalogue(const std::string& runName) {
  auto all = floorMeasurements();
  for (auto more :
       {peerMeasurements(runName), oneThreadMeasurements(runName), underLoadMeasurements(runName),
        scaleMeasurements(runName), deathMeasurements(runName), tappedMeasurements(runName),
        fanOutMeasurements(runName)}) {
    std::move(more.begin(), more.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace mpf::bench
