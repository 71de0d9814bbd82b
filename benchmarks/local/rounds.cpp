// SPDX-License-Identifier: MIT
#include "benchmarks/local/rounds.h"

#include <algorithm>
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

// The highest floor of these rounds divided by the lowest one; 0 with only one.
double floorDrift(const std::vector<Round>& rounds) {
  std::vector<double> floors;
  for (const auto& round : rounds) {
    for (const auto ns : {round.floorBeforeNs, round.floorAfterNs})
      if (ns > 0) floors.push_back(ns);
  }
  if (floors.size() < 2) return 0;
  const auto [lowest, highest] = std::ranges::minmax(floors);
  return highest / lowest;
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

std::vector<Round> Rounds::agreeingRounds() const {
  std::vector<Round> calm;
  std::ranges::copy_if(rounds_, std::back_inserter(calm), &Round::isCalm);
  const auto lowest = [](const Round& round) { return round.lines.lowestNs; };
  std::ranges::sort(calm, {}, lowest);
  auto best = std::ranges::subrange(calm.begin(), calm.begin());
  for (auto begin = calm.begin(); begin != calm.end(); ++begin) {
    const auto end = std::find_if(begin, calm.end(), [&](const Round& round) {
      return lowest(round) > lowest(*begin) * Result::kLargeLineDrift;
    });
    if (end - begin > std::ssize(best)) best = {begin, end};
  }
  return {best.begin(), best.end()};
}

void Rounds::writeTo(Result& result) const {
  auto rounds = agreeingRounds();
  if (rounds.empty()) rounds = rounds_;
  if (rounds.empty()) return;
  result.figures = combined(rounds);
  for (const auto& round : rounds) result.disturbance.add(round.disturbance);
  result.rounds = rounds.size();
  result.floorDrift = floorDrift(rounds);
  result.lineDrift = medianOf(rounds, [](const Round& round) { return round.lines.drift(); });
  if (result.measurement.floorName.empty() || rounds.front().floorBeforeNs <= 0) return;
  result.floorNs = medianOf(rounds, [](const Round& round) { return round.floorBeforeNs; });
  result.ratioToFloor = medianOf(
      rounds, [](const Round& round) { return costNs(round.figures) / round.floorBeforeNs; });
}

}  // namespace mpf::bench
