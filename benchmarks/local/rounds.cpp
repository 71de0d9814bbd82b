// SPDX-License-Identifier: MIT
#include "benchmarks/local/rounds.h"

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace mpf::bench {
namespace {

// 0 without values.
double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

template <class Value>
double medianOf(const std::vector<Round>& rounds, const Value& value) {
  std::vector<double> values;
  for (const auto& round : rounds) values.push_back(value(round));
  return median(std::move(values));
}

Figures combined(const std::vector<Round>& rounds) {
  const auto median = [&](double Figures::* figure) {
    return medianOf(rounds, [&](const Round& round) { return round.figures.*figure; });
  };
  Figures figures;
  for (const auto& round : rounds) {
    figures.latency.add(round.figures.latency);
    figures.count += round.figures.count;
  }
  figures.typicalNs = median(&Figures::typicalNs);
  figures.perSecond = median(&Figures::perSecond);
  figures.value = median(&Figures::value);
  figures.writesPerSecond = median(&Figures::writesPerSecond);
  figures.idleServer = median(&Figures::idleServer);
  figures.idleRequester = median(&Figures::idleRequester);
  figures.lineFaults = rounds.back().figures.lineFaults;  // rows of serial lines have one round
  return figures;
}

// Of more than half of the floor's values, those closest to each other: the highest divided by the
// lowest one. 0 with only one value.
double floorDrift(const std::vector<Round>& rounds) {
  std::vector<double> floors;
  for (const auto& round : rounds) {
    for (const auto ns : {round.floorBeforeNs, round.floorAfterNs})
      if (ns > 0) floors.push_back(ns);
  }
  if (floors.size() < 2) return 0;
  std::ranges::sort(floors);
  const auto most = floors.size() / 2 + 1;
  auto drift = floors.back() / floors.front();
  for (std::size_t first = 0; first + most <= floors.size(); ++first)
    drift = std::min(drift, floors[first + most - 1] / floors[first]);
  return drift;
}

std::size_t countCalm(const Rounds& row, double lineNs) {
  return static_cast<std::size_t>(std::ranges::count_if(
      row.all(), [&](const Round& round) { return round.isCalmWith(lineNs); }));
}

}  // namespace

void LineTimes::add(double ns) noexcept {
  if (ns > 0) add(LineTimes{ns, ns});
}

void LineTimes::add(const LineTimes& other) noexcept {
  if (other.lowestNs <= 0) return;
  lowestNs = lowestNs > 0 ? std::min(lowestNs, other.lowestNs) : other.lowestNs;
  highestNs = std::max(highestNs, other.highestNs);
}

bool Round::isCalmWith(double lineNs) const noexcept {
  constexpr auto kMost = Result::kLargeLineDrift;
  return lines.drift() <= kMost && lines.lowestNs >= lineNs && lines.lowestNs <= lineNs * kMost;
}

void Rounds::writeTo(Result& result, double lineNs) const {
  std::vector<Round> calm;
  std::ranges::copy_if(rounds_, std::back_inserter(calm),
                       [&](const Round& round) { return round.isCalmWith(lineNs); });
  const auto& rounds = calm.empty() ? rounds_ : calm;
  if (rounds.empty()) return;
  result.figures = combined(rounds);
  for (const auto& round : rounds) result.disturbance.add(round.disturbance);
  result.rounds = rounds.size();
  result.floorDrift = floorDrift(rounds);
  result.haveLinesMoved = calm.empty();
  result.lineDrift = medianOf(rounds, [&](Round round) {
    if (calm.empty()) round.lines.add(lineNs);
    return round.lines.drift();
  });
  auto compared = rounds;
  std::erase_if(compared, [](const Round& round) { return round.floorBeforeNs <= 0; });
  result.floorNs = medianOf(compared, [](const Round& round) { return round.floorBeforeNs; });
  result.ratioToFloor = medianOf(
      compared, [](const Round& round) { return costNs(round.figures) / round.floorBeforeNs; });
}

std::size_t fewestCalm(std::span<const Rounds* const> rows, double lineNs) {
  auto fewest = SIZE_MAX;
  for (const auto* row : rows) fewest = std::min(fewest, countCalm(*row, lineNs));
  return fewest;
}

double chooseLines(std::span<const Rounds* const> rows, std::size_t wanted) {
  std::vector<double> times;
  for (const auto* row : rows) {
    for (const auto& round : row->all()) times.push_back(round.lines.lowestNs);
  }
  if (times.empty()) return 0;
  std::ranges::sort(times);
  return std::ranges::max(times, {}, [&](double lineNs) {
    std::size_t sum = 0;
    for (const auto* row : rows) sum += std::min(countCalm(*row, lineNs), wanted);
    return sum;
  });
}

}  // namespace mpf::bench
