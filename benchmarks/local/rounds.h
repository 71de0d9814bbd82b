// SPDX-License-Identifier: MIT
// Rounds: the results of one row in several rounds, and which of them count.
//
// A host may move the processors of a virtual machine at any time, and a cache line then needs 70
// ns or 500 ns between the same two CPUs. A round of a row is calm if a cache line took about as
// long before and after the row as before and after its floor. Calm rounds agree if it took about
// as long in them, too. The rows of a block use rounds that agree with each other; a row without
// such a round uses all of its rounds.
//
// Threads  one.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

// How long a cache line took, at several times.
struct LineTimes {
  double lowestNs = 0;  // 0: not measured
  double highestNs = 0;

  void add(double ns) noexcept;
  void add(const LineTimes& other) noexcept;
  // 0: not measured
  [[nodiscard]] double drift() const noexcept { return lowestNs > 0 ? highestNs / lowestNs : 0; }
};

struct Round {
  Figures figures;
  Disturbance disturbance;
  LineTimes lines;  // beside the row and its floor
  double floorBeforeNs = 0;  // 0: the row has no floor
  double floorAfterNs = 0;  // 0: not measured

  // Whether it is calm, and the shortest time of a line was between `lineNs` and
  // Result::kLargeLineDrift x `lineNs`.
  [[nodiscard]] bool isCalmWith(double lineNs) const noexcept;
};

class Rounds {
 public:
  void add(const Round& round) { rounds_.push_back(round); }
  // Of the round that was added last.
  void setFloorAfter(double ns) noexcept { rounds_.back().floorAfterNs = ns; }
  // Sets the figures, the floor and what disturbed them, from the rounds that are calm with these
  // lines.
  void writeTo(Result& result, double lineNs) const;
  [[nodiscard]] const std::vector<Round>& all() const noexcept { return rounds_; }

 private:
  std::vector<Round> rounds_;
};

// The time of a line with which these rows together have most calm rounds, of which no more than
// `wanted` of each row are counted. Of several times, the shortest.
[[nodiscard]] double chooseLines(std::span<const Rounds* const> rows, std::size_t wanted);
// The number of rounds that are calm with these lines, of the row that has the fewest.
[[nodiscard]] std::size_t fewestCalm(std::span<const Rounds* const> rows, double lineNs);

}  // namespace mpf::bench
