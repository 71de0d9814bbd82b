// SPDX-License-Identifier: MIT
// Report: results as a table for people and as JSON for programs.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "benchmarks/stage/machine.h"
#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

// "4.22 M/s".
[[nodiscard]] std::string rateText(double perSecond);
// A line: "  2.31 us".
[[nodiscard]] std::string oneLine(const Result& result);
// Rows under their questions. `heading`, of the first row, stands below its question and may be
// empty.
[[nodiscard]] std::string sections(const std::vector<Result>& results,
                                   const std::function<std::string(const Measurement&)>& heading,
                                   const std::function<std::string(const Result&)>& row);
[[nodiscard]] std::string table(const std::vector<Result>& results);
// The goals of the project beside what was reached; only those whose rows were taken.
[[nodiscard]] std::string goals(const std::vector<Result>& results);
// A list of objects, one a row; see README.md.
[[nodiscard]] std::string toJson(const std::vector<Result>& results, const Machine& machine,
                                 const Placement& placement);

}  // namespace mpf::bench
