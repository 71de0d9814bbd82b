// SPDX-License-Identifier: MIT
#include <mpf/benchmarks/measurement.h>

#include <algorithm>

namespace mpf::bench {

double Result::costNs() const noexcept {
  if (!isGood()) return 0;
  if (figures.typicalNs > 0) return figures.typicalNs;
  if (figures.latency.count() != 0) return static_cast<double>(figures.latency.percentileNs(50));
  return figures.perSecond > 0 ? 1e9 / figures.perSecond : 0;
}

void divideByFloors(std::vector<Result>& results) {
  for (auto& result : results) {
    const auto& wanted = result.measurement;
    const auto floor = std::find_if(results.begin(), results.end(), [&](const Result& other) {
      return other.measurement.name == wanted.floorName && other.measurement.bytes == wanted.floorBytes;
    });
    if (!wanted.floorName.empty() && floor != results.end() && floor->costNs() > 0) result.ratioToFloor = result.costNs() / floor->costNs();
  }
}

std::vector<Measurement> catalogue(bool quick, const std::string& runName) {
  auto all = floorMeasurements(quick);
  for (auto more : {peerMeasurements(quick, runName), scaleMeasurements(quick, runName)}) {
    std::move(more.begin(), more.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace mpf::bench
