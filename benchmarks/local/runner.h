// SPDX-License-Identifier: MIT
// Runner: measures the rows of a block in rounds, and compares all of them with the same floor.
//
//   line, floor, line, row 1, line, row 2, line ... row n, line;  line, floor, line, row 1 ...
//   ratio of a row = median of its ratios in the rounds that count, each to the floor of that round
//
// A floor that was measured a minute ago cannot be compared, because the host may have moved the
// processors (local/rounds.h), and so every round measures its floors again; two rows with
// different measurements of a floor cannot be compared with each other, and so the rows of a round
// share them. In blocks of several rounds a cache line is timed for a moment before and after each
// row and each floor, to find the rounds that count; rounds are repeated until enough of them
// agree, or kMostTimes as many as planned were measured. Where lines are not timed, the floors are
// measured once more after a round of several rows.
//
// Threads  the runner's only one.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "benchmarks/local/rounds.h"
#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

struct PlannedRow {
  Measurement row;
  Budget budget;
  int rounds = 1;  // that agree; at least 1
};

class Runner {
 public:
  static constexpr int kMostTimes = 2;

  //   all   contains the floors
  //   line  times a cache line; nullptr: lines are not timed
  // Both must outlive the runner.
  Runner(Placement placement, const std::vector<Measurement>& all,
         const Measurement* line = nullptr) noexcept
      : placement_(std::move(placement)), all_(all), line_(line) {}

  // The results of the rows, in their order.
  [[nodiscard]] std::vector<Result> run(std::vector<PlannedRow> block);

 private:
  // A floor in one round.
  struct Floor {
    const Measurement* row = nullptr;  // nullptr: not among `all`
    Budget budget;
    LineTimes lines;
    double beforeNs = 0;
    double afterNs = 0;
  };
  // By setting, name and bytes.
  using Floors = std::map<std::tuple<std::string, std::string, std::size_t>, Floor>;
  struct Row {
    Budget budget;
    int planned = 1;  // rounds
    Rounds rounds;
    Result result;
  };
  using Block = std::vector<Row>;
  [[nodiscard]] static std::vector<const Rounds*> repeatedIn(const Block& block);
  void measureRound(Block& block, int round);
  [[nodiscard]] std::string enter(const Measurement& row);
  // The floor of a row, which is measured the first time in a round. `lineNs` is the time of a line
  // before this, and becomes that after it.
  [[nodiscard]] const Floor& floorOf(const Measurement& row, Budget budget, Floors& floors,
                                     double& lineNs);
  [[nodiscard]] double measure(const Floor& floor) const;
  // How long a cache line takes now; 0: lines are not timed.
  [[nodiscard]] double timeLine() const;

  Placement placement_;
  const std::vector<Measurement>& all_;
  const Measurement* line_;
  bool timesLines_ = false;  // in this block
  std::unique_ptr<Environment> environment_;  // of the last row; the next row may use it again
  std::string current_;
  std::map<std::string, std::string> missing_;
};

}  // namespace mpf::bench
