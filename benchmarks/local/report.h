// SPDX-License-Identifier: MIT
// Results as a table and as JSON.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "benchmarks/stage/machine.h"
#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

// "4.22 M/s".
[[nodiscard]] std::string rateText(double perSecond);
// The progress line of a row: its heading, name and mode, and the result or the reason without one.
[[nodiscard]] std::string oneLine(const Result& result);
// All rows under their questions. `heading` is called for the first row of each question; its text
// is the line below the question and may be empty.
[[nodiscard]] std::string sections(const std::vector<Result>& results,
                                   const std::function<std::string(const Measurement&)>& heading,
                                   const std::function<std::string(const Result&)>& row);
[[nodiscard]] std::string table(const std::vector<Result>& results);
// The goals of the project and what was reached; see GoalSheet.
[[nodiscard]] std::string goals(const std::vector<Result>& results);
// A list with one object for each row; see README.md.
[[nodiscard]] std::string toJson(const std::vector<Result>& results, const Machine& machine,
                                 const Placement& placement);

}  // namespace mpf::bench
