// SPDX-License-Identifier: MIT
#include "benchmarks/local/runner.h"

#include <algorithm>
#include <exception>

namespace mpf::bench {
namespace {

// 0 without values.
double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

// Combines the results of several rounds.
class Rounds {
 public:
  void add(const Figures& figures, double floorNs) {
    latency_.add(figures.latency);
    count_ += figures.count;
    typical_.push_back(figures.typicalNs);
    perSecond_.push_back(figures.perSecond);
    values_.push_back(figures.value);
    writes_.push_back(figures.writesPerSecond);
    idleServer_.push_back(figures.idleServer);
    idleRequester_.push_back(figures.idleRequester);
    lineFaults_ = figures.lineFaults;
    if (floorNs <= 0) return;
    floors_.push_back(floorNs);
    ratios_.push_back(costNs(figures) / floorNs);
  }
  void addDrift(double drift) { drifts_.push_back(drift); }
  void writeTo(Result& result) const {
    result.figures = {latency_,
                      median(typical_),
                      count_,
                      median(perSecond_),
                      median(values_),
                      median(writes_),
                      median(idleServer_),
                      median(idleRequester_)};
    result.figures.lineFaults = lineFaults_;
    result.floorNs = median(floors_);
    result.ratioToFloor = median(ratios_);
    result.floorDrift = median(drifts_);
  }

 private:
  LatencyRecorder latency_;
  std::uint64_t count_ = 0;
  LineFaultFigures lineFaults_;  // of the last round; rows of serial lines have only one
  std::vector<double> typical_, perSecond_, values_, writes_, idleServer_, idleRequester_, floors_,
      ratios_, drifts_;
};

}  // namespace

std::vector<Result> Runner::run(std::vector<PlannedRow> block) {
  std::vector<Result> results(block.size());
  std::vector<Rounds> rounds(block.size());
  int last = 1;
  for (std::size_t i = 0; i < block.size(); ++i) {
    results[i].measurement = std::move(block[i].row);
    last = std::max(last, block[i].rounds);
  }
  for (int round = 0; round < last; ++round) {
    Floors floors;
    std::map<std::size_t, const Floor*> compared;  // by index of a row of this round
    for (std::size_t i = 0; i < block.size(); ++i) {
      auto& result = results[i];
      auto& row = result.measurement;
      if (!result.isGood() || round >= std::max(block[i].rounds, 1)) continue;
      row.skipped = enter(row);
      if (!row.skipped.empty()) continue;
      const auto& floor = floorOf(row, block[i].budget, floors);
      compared[i] = &floor;
      const DisturbanceMeter meter(placement_);
      const auto outcome = row.run(Stage(placement_, block[i].budget));
      result.disturbance.add(meter.read());
      rounds[i].add(outcome.figures, floor.beforeNs);
      result.error = outcome.error;
    }
    if (block.size() == 1) continue;
    for (auto& [key, floor] : floors) floor.afterNs = measure(floor);
    for (const auto& [index, floor] : compared) rounds[index].addDrift(floor->drift());
  }
  for (std::size_t i = 0; i < block.size(); ++i) {
    if (results[i].measurement.skipped.empty()) rounds[i].writeTo(results[i]);
  }
  return results;
}

// Starts the environment of this row. Empty, or why it cannot be started; it is not tried again.
std::string Runner::enter(const Measurement& row) try {
  if (row.environmentName == current_) return {};
  environment_.reset();
  current_.clear();
  if (!row.environment) return {};
  if (const auto known = missing_.find(row.environmentName); known != missing_.end())
    return known->second;
  environment_ = row.environment();
  current_ = row.environmentName;
  return {};
} catch (const std::exception& exception) {
  return missing_[row.environmentName] = exception.what();
}

const Runner::Floor& Runner::floorOf(const Measurement& row, Budget budget, Floors& floors) {
  const auto [known, isNew] = floors.try_emplace({row.setting, row.floorName, row.floorBytes});
  auto& floor = known->second;
  if (!isNew || row.floorName.empty()) return floor;
  const auto found = std::find_if(all_.begin(), all_.end(), [&](const Measurement& other) {
    return other.setting == row.setting && other.name == row.floorName &&
           other.bytes == row.floorBytes;
  });
  if (found != all_.end()) floor.row = &*found;
  floor.budget = {budget.warmUp / 2, budget.measure / 2};
  floor.beforeNs = measure(floor);
  return floor;
}

// 0 without a floor.
double Runner::measure(const Floor& floor) const {
  return floor.row == nullptr ? 0 : costNs(floor.row->run(Stage(placement_, floor.budget)).figures);
}

double Runner::Floor::drift() const noexcept {
  if (beforeNs <= 0 || afterNs <= 0) return 0;
  return std::max(beforeNs, afterNs) / std::min(beforeNs, afterNs);
}

}  // namespace mpf::bench
