// SPDX-License-Identifier: MIT
// GoalSheet: compares the goals of the project with the results of a run. Goals without a result
// are left out.
#pragma once

#include <algorithm>
#include <fmt/format.h>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

class GoalSheet {
 public:
  explicit GoalSheet(const std::vector<Result>& results) : results_(results) {}

  // The successful row of this name, or nullptr. Its heading begins with `question`. Without
  // `mode`, any mode matches.
  [[nodiscard]] const Result* find(std::string_view question, std::string_view name,
                                   std::optional<Mode> mode = {}) const {
    const auto found = std::find_if(results_.begin(), results_.end(), [&](const Result& result) {
      const auto& what = result.measurement;
      return result.isGood() && what.question.starts_with(question) && what.name == name &&
             (!mode || what.mode == *mode);
    });
    return found == results_.end() ? nullptr : &*found;
  }
  [[nodiscard]] std::optional<double> ratioToFloor(const Result* row) const {
    return row != nullptr && row->ratioToFloor > 0 ? std::optional(row->ratioToFloor)
                                                   : std::nullopt;
  }
  // The ratio of the costs of two rows. Each is divided by the same floor as it was measured right
  // before that row, since the two rows were taken at different times.
  [[nodiscard]] std::optional<double> costRatio(const Result* row, const Result* to) const {
    const bool known =
        row != nullptr && to != nullptr && row->ratioToFloor > 0 && to->ratioToFloor > 0;
    return known ? std::optional(row->ratioToFloor / to->ratioToFloor) : std::nullopt;
  }

  void atMost(std::string_view goal, std::optional<double> reached, double limit) {
    add(goal, reached, limit, reached && *reached <= limit);
  }
  void atLeast(std::string_view goal, std::optional<double> reached, double limit) {
    add(goal, reached, limit, reached && *reached >= limit);
  }
  // Empty when no goal has a result.
  [[nodiscard]] std::string text() const {
    return text_.empty()
               ? ""
               : fmt::format("\n{:<68} {:>9} {:>9}\n", "Goals", "goal", "reached") + text_;
  }

 private:
  void add(std::string_view goal, std::optional<double> reached, double limit, bool good) {
    if (reached)
      text_ += fmt::format("  {:<66} {:>9.2f} {:>9.2f}  {}\n", goal, limit, *reached,
                           good ? "reached" : "MISSED");
  }
  const std::vector<Result>& results_;
  std::string text_;
};

}  // namespace mpf::bench
