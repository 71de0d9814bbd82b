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
  }

 private:
  LatencyRecorder latency_;
  std::uint64_t count_ = 0;
  LineFaultFigures lineFaults_;  // of the last round; rows of serial lines have only one
  std::vector<double> typical_, perSecond_, values_, writes_, idleServer_, idleRequester_, floors_,
      ratios_;
};

}  // namespace

Result Runner::run(Measurement row, Budget budget, int rounds) {
  Result result;
  if (row.skipped.empty()) row.skipped = enter(row);
  result.measurement = std::move(row);
  if (!result.isGood()) return result;
  const Stage stage(placement_, budget);
  Rounds all;
  for (int round = 0; round < std::max(rounds, 1); ++round) {
    const auto floorNs = measureFloor(result.measurement, budget, rounds);
    const auto outcome = result.measurement.run(stage);
    all.add(outcome.figures, floorNs);
    result.error = outcome.error;
    if (!result.error.empty()) break;
  }
  all.writeTo(result);
  return result;
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

// 0 when the row has no floor.
double Runner::measureFloor(const Measurement& row, Budget budget, int rounds) {
  if (row.floorName.empty()) return 0;
  auto& known = lastFloor_[{row.setting, row.floorName, row.floorBytes}];
  if (rounds == 0 && known > 0) return known;
  const auto floor = std::find_if(all_.begin(), all_.end(), [&](const Measurement& other) {
    return other.setting == row.setting && other.name == row.floorName &&
           other.bytes == row.floorBytes;
  });
  if (floor == all_.end()) return 0;
  return known =
             costNs(floor->run(Stage(placement_, {budget.warmUp / 2, budget.measure / 2})).figures);
}

}  // namespace mpf::bench
