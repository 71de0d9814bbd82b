// SPDX-License-Identifier: MIT
#include "benchmarks/local/runner.h"

#include <algorithm>
#include <chrono>
#include <exception>

namespace mpf::bench {
namespace {

constexpr std::chrono::milliseconds kWarmLine{2}, kTimeLine{10};

// Whether a row is measured in this round, the first of which is 0.
bool isDue(const PlannedRow& row, const Rounds& results, int round) {
  const auto planned = std::max(row.rounds, 1);
  if (round < planned) return true;
  // A row with one round has no others that could agree with it.
  return planned > 1 && round < Runner::kMostTimes * planned &&
         results.agreeing() < static_cast<std::size_t>(planned);
}

}  // namespace

std::vector<Result> Runner::run(std::vector<PlannedRow> block) {
  std::vector<Result> results(block.size());
  std::vector<Rounds> rounds(block.size());
  for (std::size_t i = 0; i < block.size(); ++i) results[i].measurement = std::move(block[i].row);
  timesLines_ = line_ != nullptr &&
                std::ranges::any_of(block, [](const auto& row) { return row.rounds > 1; });
  for (int round = 0; measureRound(block, round, results, rounds); ++round) continue;
  for (std::size_t i = 0; i < block.size(); ++i) rounds[i].writeTo(results[i]);
  return results;
}

// Returns false if no row is measured in this round.
bool Runner::measureRound(const std::vector<PlannedRow>& block, int round,
                          std::vector<Result>& results, std::vector<Rounds>& rounds) {
  Floors floors;
  std::map<std::size_t, const Floor*> compared;  // by index of a row of this round
  double lineNs = 0;
  for (std::size_t i = 0; i < block.size(); ++i) {
    auto& result = results[i];
    auto& row = result.measurement;
    if (!result.isGood() || !isDue(block[i], rounds[i], round)) continue;
    row.skipped = enter(row);
    if (!row.skipped.empty()) continue;
    if (compared.empty()) lineNs = timeLine();
    const auto& floor = floorOf(row, block[i].budget, floors, lineNs);
    compared[i] = &floor;
    auto lines = floor.lines;
    lines.add(lineNs);
    const DisturbanceMeter meter(placement_);
    auto outcome = row.run(Stage(placement_, block[i].budget));
    const auto disturbance = meter.read();
    lineNs = timeLine();
    lines.add(lineNs);
    rounds[i].add({std::move(outcome.figures), disturbance, lines, floor.beforeNs});
    result.error = std::move(outcome.error);
  }
  if (block.size() == 1 || timesLines_) return !compared.empty();
  for (auto& [key, floor] : floors) floor.afterNs = measure(floor);
  for (const auto& [index, floor] : compared) rounds[index].setFloorAfter(floor->afterNs);
  return !compared.empty();
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

const Runner::Floor& Runner::floorOf(const Measurement& row, Budget budget, Floors& floors,
                                     double& lineNs) {
  const auto [known, isNew] = floors.try_emplace({row.setting, row.floorName, row.floorBytes});
  auto& floor = known->second;
  if (!isNew || row.floorName.empty()) return floor;
  const auto found = std::find_if(all_.begin(), all_.end(), [&](const Measurement& other) {
    return other.setting == row.setting && other.name == row.floorName &&
           other.bytes == row.floorBytes;
  });
  if (found != all_.end()) floor.row = &*found;
  floor.budget = {budget.warmUp / 2, budget.measure / 2};
  floor.lines.add(lineNs);
  floor.beforeNs = measure(floor);
  lineNs = timeLine();
  floor.lines.add(lineNs);
  return floor;
}

double Runner::timeLine() const {
  if (!timesLines_) return 0;
  return costNs(line_->run(Stage(placement_, {kWarmLine, kTimeLine})).figures);
}

// 0 without a floor.
double Runner::measure(const Floor& floor) const {
  return floor.row == nullptr ? 0 : costNs(floor.row->run(Stage(placement_, floor.budget)).figures);
}

}  // namespace mpf::bench
