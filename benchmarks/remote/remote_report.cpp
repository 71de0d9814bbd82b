// SPDX-License-Identifier: MIT
// The table of `mpf bench remote`: the columns of the manual's table ("Performance"), and
// latencies.
#include <array>
#include <fmt/format.h>

#include "base/duration_text.h"
#include "benchmarks/local/report.h"
#include "benchmarks/remote/remote.h"

namespace mpf::bench {
namespace {

constexpr const char* kLine =
    "  {:<40} {:>11} {:>10} {:>7} {:>7} {:>9} {:>9} {:>9} {:>9} {:>7}  {}\n";
constexpr std::size_t kLarge = 1u << 16;  // for messages of this size the rate is in bytes

// "12.3 k/s", or "1.23 GiB/s" for large messages: the rate in one direction, which equals that in
// the other one.
std::string speedText(double perSecond, std::size_t bytes) {
  if (bytes < kLarge) return rateText(perSecond);
  return fmt::format("{:.2f} GiB/s",
                     perSecond * static_cast<double>(bytes) / static_cast<double>(1u << 30));
}

std::string percentText(double share) {
  return share < 0 ? "" : fmt::format("{:.0f} %", 100 * share);
}

std::string lineOf(const Result& result) {
  const auto& what = result.measurement;
  const auto& figures = result.figures;
  if (!what.skipped.empty()) return fmt::format("  {:<40} left out: {}\n", what.name, what.skipped);
  if (!result.error.empty()) return fmt::format("  {:<40} failed: {}\n", what.name, result.error);
  if (!what.unit.empty())
    return fmt::format("  {:<40} {:>11.4g} {}\n", what.name, figures.value, what.unit);
  const auto at = [&](double percent) {
    return durationText(static_cast<double>(figures.latency.percentileNs(percent)));
  };
  const bool isCompared = result.ratioToFloor > 0;
  return fmt::format(
      kLine, what.name, speedText(figures.perSecond, what.bytes),
      figures.writesPerSecond < 0 ? "" : rateText(figures.writesPerSecond),
      percentText(figures.idleRequester), percentText(figures.idleServer), at(50), at(99), at(99.9),
      durationText(static_cast<double>(figures.latency.maxNs())),
      isCompared ? fmt::format("{:.2f}", 1 / result.ratioToFloor) : "",
      isCompared ? speedText(1e9 / result.floorNs, what.bytes) + ": " + what.floorName : "");
}

std::string header(const Measurement& first) {
  if (!first.unit.empty()) return {};  // each line shows its unit
  return fmt::format(kLine, "", first.bytes >= kLarge ? "each way" : "messages", "writes",
                     "idle cl", "idle sv", "p50", "p99", "p99.9", "max", "x TCP", "raw TCP was");
}

}  // namespace

std::string remoteTable(const std::vector<Result>& results) {
  return sections(results, header, lineOf);
}

}  // namespace mpf::bench
