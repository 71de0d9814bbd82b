// SPDX-License-Identifier: MIT
// Runner: measures the rows of a block in rounds, and compares all of them with the same floor.
//
//   floor, row 1, row 2 ... row n, floor;  floor, row 1 ... row n, floor;  ...
//   ratio of a row = median of its ratios in the rounds that count, each to the floor of that round
//
// A floor that was measured a minute ago cannot be compared, because the host may have moved the
// processors (local/rounds.h), and so every round measures its floors again; two rows with
// different measurements of a floor cannot be compared with each other, and so the rows of a round
// share them. The floors are measured once more after a round of several rows. Rounds are repeated
// until enough of them agree, or kMostTimes as many as planned were measured.
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

  // `all` must outlive the runner; it contains the floors.
  Runner(Placement placement, const std::vector<Measurement>& all) noexcept
      : placement_(std::move(placement)), all_(all) {}

  // The results of the rows, in their order.
  [[nodiscard]] std::vector<Result> run(std::vector<PlannedRow> block);

 private:
  // A floor in one round.
  struct Floor {
    const Measurement* row = nullptr;  // nullptr: not among `all`
    Budget budget;
    double beforeNs = 0;
    double afterNs = 0;
  };
  // By setting, name and bytes.
  using Floors = std::map<std::tuple<std::string, std::string, std::size_t>, Floor>;
  bool measureRound(const std::vector<PlannedRow>& block, int round, std::vector<Result>& results,
                    std::vector<Rounds>& rounds);
  [[nodiscard]] std::string enter(const Measurement& row);
  // The floor of a row, which is measured the first time in a round.
  [[nodiscard]] const Floor& floorOf(const Measurement& row, Budget budget, Floors& floors);
  [[nodiscard]] double measure(const Floor& floor) const;

  Placement placement_;
  const std::vector<Measurement>& all_;
  std::unique_ptr<Environment> environment_;  // of the last row; the next row may use it again
  std::string current_;
  std::map<std::string, std::string> missing_;
};

}  // namespace mpf::bench
