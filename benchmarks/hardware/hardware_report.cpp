// SPDX-License-Identifier: MIT
// The table of `mpf bench hardware`.
#include <fmt/format.h>

#include "base/duration_text.h"
#include "benchmarks/hardware/hardware.h"
#include "benchmarks/local/report.h"

namespace mpf::bench {
namespace {

constexpr const char* kHardwareLine = "  {:<54} {:>10} {:>9} {:>9} {:>9} {:>9} {:>9}  {}\n";
constexpr const char* kOne = "  {:<54} {}\n";

// The faults that the replies reported for incomplete answers.
std::string faultsText(const LineFaultFigures& faults) {
  const auto unnamed = faults.overruns + faults.parity + faults.framing + faults.breaks == 0 &&
                       faults.shortAnswers > 0;
  return fmt::format("; with overruns {}, parity errors {}, framing errors {}, breaks {}{}",
                     faults.overruns, faults.parity, faults.framing, faults.breaks,
                     unnamed ? ": the server reported no line fault" : "");
}

std::string hardwareLineOf(const Result& result) {
  const auto& what = result.measurement;
  const auto& figures = result.figures;
  if (!what.skipped.empty()) return fmt::format(kOne, what.name, "left out: " + what.skipped);
  if (!result.error.empty()) return fmt::format(kOne, what.name, "failed: " + result.error);
  if (!what.unit.empty()) {
    const bool isOfFaults = what.unit == kShortAnswers;
    return fmt::format("  {:<54} {:>8.4g} {}{}{}{}\n", what.name, figures.value, what.unit,
                       what.detail.empty() ? "" : ", ", what.detail,
                       isOfFaults ? faultsText(figures.lineFaults) : "");
  }
  const bool isMeasured = figures.latency.count() != 0;
  const auto at = [&](double percent) {
    return isMeasured ? durationText(static_cast<double>(figures.latency.percentileNs(percent)))
                      : "";
  };
  const bool isCompared = result.ratioToFloor > 0;
  return fmt::format(
      kHardwareLine, what.name, rateText(figures.perSecond), at(50), at(99), at(99.9),
      isMeasured ? durationText(static_cast<double>(figures.latency.maxNs())) : "",
      isCompared ? fmt::format("{:.3f}", 1 / result.ratioToFloor) : "",
      isCompared ? rateText(1e9 / result.floorNs) + ": " + what.floorName : what.detail);
}

std::string hardwareHeader(const Measurement& first) {
  if (!first.unit.empty()) return {};  // each line shows its unit
  const bool isServers = first.question == kServers;
  return fmt::format(kHardwareLine, "", "messages", "p50", "p99", "p99.9", "max",
                     isServers ? "x echo" : "x manual", isServers ? "the echo was" : "");
}

}  // namespace

std::string hardwareTable(const std::vector<Result>& results) {
  return sections(results, hardwareHeader, hardwareLineOf);
}

}  // namespace mpf::bench
