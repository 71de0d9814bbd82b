// SPDX-License-Identifier: MIT
#include "benchmarks/local/runner.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <utility>

namespace mpf::bench {
namespace {

constexpr std::chrono::milliseconds kWarmLine{2}, kTimeLine{10};

}  // namespace

std::vector<Result> Runner::run(std::vector<PlannedRow> block) {
  Block all(block.size());
  for (std::size_t i = 0; i < block.size(); ++i) {
    all[i].budget = block[i].budget;
    all[i].planned = std::max(block[i].rounds, 1);
    all[i].result.measurement = std::move(block[i].row);
  }
  const auto most = std::ranges::max(all, {}, &Row::planned).planned;
  timesLines_ = line_ != nullptr && most > 1;
  double lineNs = 0;
  for (int round = 0; round < (timesLines_ ? kMostTimes : 1) * most; ++round) {
    const auto repeated = repeatedIn(all);
    if (round >= most && fewestCalm(repeated, lineNs) >= static_cast<std::size_t>(most)) break;
    measureRound(all, round);
    lineNs = chooseLines(repeated, static_cast<std::size_t>(most));
  }
  std::vector<Result> results;
  for (auto& row : all) {
    const std::array alone{&std::as_const(row.rounds)};
    row.rounds.writeTo(row.result, row.planned > 1 ? lineNs : chooseLines(alone, 1));
    results.push_back(std::move(row.result));
  }
  return results;
}

// The rounds of the rows that are measured more than once.
std::vector<const Rounds*> Runner::repeatedIn(const Block& block) {
  std::vector<const Rounds*> rounds;
  for (const auto& row : block) {
    if (row.planned > 1 && row.result.isGood()) rounds.push_back(&row.rounds);
  }
  return rounds;
}

void Runner::measureRound(Block& block, int round) {
  Floors floors;
  std::map<Row*, const Floor*> compared;
  double lineNs = 0;
  for (auto& row : block) {
    auto& what = row.result.measurement;
    if (!row.result.isGood() || (row.planned == 1 && round > 0)) continue;
    what.skipped = enter(what);
    if (!what.skipped.empty()) continue;
    if (compared.empty()) lineNs = timeLine();
    const auto& floor = floorOf(what, row.budget, floors, lineNs);
    compared[&row] = &floor;
    auto lines = floor.lines;
    lines.add(lineNs);
    const DisturbanceMeter meter(placement_);
    auto outcome = what.run(Stage(placement_, row.budget));
    const auto disturbance = meter.read();
    lineNs = timeLine();
    lines.add(lineNs);
    row.rounds.add({std::move(outcome.figures), disturbance, lines, floor.beforeNs});
    row.result.error = std::move(outcome.error);
  }
  if (block.size() == 1 || timesLines_) return;
  for (auto& [key, floor] : floors) floor.afterNs = measure(floor);
  for (const auto& [row, floor] : compared) row->rounds.setFloorAfter(floor->afterNs);
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
