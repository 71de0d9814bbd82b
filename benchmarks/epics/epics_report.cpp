// SPDX-License-Identifier: MIT
// The table and the goals of `mpf bench epics`.
#include <fmt/format.h>

#include "base/duration_text.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/local/goal_sheet.h"
#include "benchmarks/local/report.h"

namespace mpf::bench {
namespace {

constexpr const char* kEpicsLine = "  {:<44} {:>10} {:>10} {:>10} {:>10} {:>10}  {}\n";

std::string epicsLineOf(const Result& result) {
  const auto& what = result.measurement;
  const auto& figures = result.figures;
  if (!what.skipped.empty()) return fmt::format("  {:<44} left out: {}\n", what.name, what.skipped);
  if (!result.error.empty()) return fmt::format("  {:<44} failed: {}\n", what.name, result.error);
  if (!what.unit.empty())
    return fmt::format("  {:<44} {:>10.4g} {}\n", what.name, figures.value, what.unit);
  const auto at = [&](double percent) {
    return figures.latency.count() == 0
               ? ""
               : durationText(static_cast<double>(figures.latency.percentileNs(percent)));
  };
  const auto each = costNs(figures);
  return fmt::format(
      kEpicsLine, what.name, figures.perSecond == 0 ? "" : rateText(figures.perSecond),
      each == 0 ? "" : durationText(each), at(50), at(99), at(99.9),
      result.ratioToFloor > 0 ? fmt::format("{:.2f} x {}", result.ratioToFloor, what.floorName)
                              : what.detail);
}

std::string epicsHeader(const Measurement& first) {
  if (!first.unit.empty()) return {};  // each line shows its unit
  return fmt::format(kEpicsLine, "", "a second", "each", "p50", "p99", "p99.9", "");
}

}  // namespace

std::string epicsTable(const std::vector<Result>& results) {
  return sections(results, epicsHeader, epicsLineOf);
}

std::string epicsGoals(const std::vector<Result>& results) {
  GoalSheet goals(results);
  constexpr double kGoalRate = 100'000;
  constexpr double kGoalCpu = 25;
  constexpr double kMicrosecond = 1000;
  if (const auto* row = goals.find(kRecords, kThousand))
    goals.atLeast("1000 records [a second], at least", row->figures.perSecond, kGoalRate);
  const auto* bare = goals.find(kRecords, kBareClient);
  const auto* bounce = goals.find("Floors", kFutexBounce);
  const auto* record = goals.find(kRecords, kOneRecord);
  if (bare != nullptr && bounce != nullptr && record != nullptr)
    goals.atMost("added to a bare message by a record [us], half a futex bounce + 5 us",
                 (record->costNs() - bare->costNs()) / kMicrosecond,
                 bounce->costNs() / 2 / kMicrosecond + 5);
  if (const auto* row = goals.find(kScanned, kIocCpu))
    goals.atMost("10 000 records at 10 Hz, IOC [% of one CPU], at most", row->figures.value,
                 kGoalCpu);
  const auto percentileMs = [&](const std::string& name) -> std::optional<double> {
    for (const auto& result : results)
      if (result.isGood() && result.measurement.name.starts_with(name))
        return static_cast<double>(result.figures.latency.percentileNs(99)) / 1e6;
    return std::nullopt;
  };
  goals.atMost("a kill until INVALID, p99 [ms], at most", percentileMs(kDeath), 10);
  goals.atMost("a restart until values, p99 [ms], at most", percentileMs(kReturn), 1000);
  if (const auto* row = goals.find(kFaults, kStopped))
    goals.atMost("change of a scan rate while one server is stopped [%], at most",
                 row->figures.value, 1);
  return goals.text();
}

}  // namespace mpf::bench
