// SPDX-License-Identifier: MIT
#include "benchmarks/local/report.h"

#include <array>
#include <fmt/format.h>

#include "base/duration_text.h"

namespace mpf::bench {
namespace {

constexpr const char* kRow = "  {:<24} {:<9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>12} {:>9}  {}\n";

std::string ratioText(const Result& result) {
  return result.ratioToFloor > 0 ? fmt::format("{:.2f}", result.ratioToFloor) : "";
}

// Empty for a row that was not disturbed.
std::string disturbanceText(const Result& result) {
  if (!result.isDisturbed()) return {};
  std::string text = "  disturbed:";
  if (result.hadLessCpu())
    text += fmt::format(" others took {:.0f} % of the CPUs", 100 * result.disturbance.share());
  if (result.haveLinesMoved) text += fmt::format(" cache lines moved x {:.2f}", result.lineDrift);
  if (result.hasFloorMoved()) text += fmt::format(" floor moved x {:.2f}", result.floorDrift);
  return text;
}

std::string heading(const Measurement&) {
  return fmt::format(kRow, "", "mode", "typical", "p50", "p99", "p99.9", "max", "rate", "x floor",
                     "floor");
}

// The name of a row. Floors of several sizes are under one heading, so their names have the size.
std::string nameOf(const Measurement& what) {
  return what.question.starts_with("Floors") && what.bytes > 4
             ? fmt::format("{} {} KiB", what.name, what.bytes / 1024)
             : what.name;
}

std::string row(const Result& result) {
  const auto& what = result.measurement;
  const auto name = nameOf(what);
  const auto& latency = result.figures.latency;
  const auto floor =
      (result.floorNs > 0 ? what.floorName + " of " + durationText(result.floorNs) : "") +
      disturbanceText(result);
  const auto line = [&](const std::array<std::string, 5>& percentiles, const std::string& rate) {
    return fmt::format(kRow, name, toString(what.mode), percentiles[0], percentiles[1],
                       percentiles[2], percentiles[3], percentiles[4], rate, ratioText(result),
                       floor);
  };
  if (!what.skipped.empty())
    return fmt::format("  {:<24} {:<9} left out: {}\n", name, toString(what.mode), what.skipped);
  if (!result.error.empty())
    return fmt::format("  {:<24} {:<9} failed: {}\n", name, toString(what.mode), result.error);
  if (!what.unit.empty())
    return fmt::format("  {:<24} {:<9} {:.6g} {}{}\n", name, toString(what.mode),
                       result.figures.value, what.unit, disturbanceText(result));
  if (latency.count() == 0) return line({}, rateText(result.figures.perSecond));
  const auto at = [&](double percent) {
    return durationText(static_cast<double>(latency.percentileNs(percent)));
  };
  return line({result.figures.typicalNs > 0 ? durationText(result.figures.typicalNs) : "", at(50),
               at(99), at(99.9), durationText(static_cast<double>(latency.maxNs()))},
              "");
}

}  // namespace

std::string rateText(double perSecond) {
  if (perSecond >= 1e6) return fmt::format("{:.2f} M/s", perSecond / 1e6);
  if (perSecond >= 1e3) return fmt::format("{:.1f} k/s", perSecond / 1e3);
  return fmt::format("{:.0f} /s", perSecond);
}

std::string oneLine(const Result& result) {
  const auto& what = result.measurement;
  auto text = what.question + ": " + what.name + ", " + toString(what.mode);
  if (!what.skipped.empty()) return text + ": left out, " + what.skipped;
  if (!result.error.empty()) return text + ": FAILED, " + result.error;
  if (!what.unit.empty()) return text + fmt::format(": {:.6g} {}", result.figures.value, what.unit);
  if (result.figures.perSecond > 0) return text + ": " + rateText(result.figures.perSecond);
  return text + ": " + durationText(result.costNs());
}

std::string sections(const std::vector<Result>& results,
                     const std::function<std::string(const Measurement&)>& heading,
                     const std::function<std::string(const Result&)>& row) {
  std::string text;
  std::string question;
  for (const auto& result : results) {
    if (result.measurement.question != question) {
      question = result.measurement.question;
      text += "\n" + question + "\n" + heading(result.measurement);
    }
    text += row(result);
  }
  return text;
}

std::string table(const std::vector<Result>& results) { return sections(results, heading, row); }

}  // namespace mpf::bench
