// SPDX-License-Identifier: MIT
// Report: results as a table for people and as JSON for programs.
#pragma once

#include <string>
#include <vector>

#include <mpf/benchmarks/machine.h>
#include <mpf/benchmarks/measurement.h>

namespace mpf::bench {

// "4.22 M/s".
[[nodiscard]] std::string rateText(double perSecond);
// A line: "  2.31 us".
[[nodiscard]] std::string oneLine(const Result& result);
[[nodiscard]] std::string table(const std::vector<Result>& results);
// The goals of the project beside what was reached; only those whose rows were taken.
[[nodiscard]] std::string goals(const std::vector<Result>& results);
// A list of objects, one a row; see README.md.
[[nodiscard]] std::string toJson(const std::vector<Result>& results, const Machine& machine, const Placement& placement);

}  // namespace mpf::bench
