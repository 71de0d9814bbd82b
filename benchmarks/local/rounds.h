// SPDX-License-Identifier: MIT
// Rounds: the results of one row in several rounds, and which of them count.
//
// A host may move the processors of a virtual machine at any time, and a cache line then needs 70
// ns or 500 ns between the same two CPUs. A round is calm if its floor was the same before and
// after it. Calm rounds agree if their floors do. The largest group of rounds that agree counts, of
// equally large ones that with the lower floors; if no round was calm, all count.
//
// Threads  one.
#pragma once

#include <cstddef>
#include <vector>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

struct Round {
  Figures figures;
  Disturbance disturbance;
  double floorBeforeNs = 0;  // 0: the row has no floor
  double floorAfterNs = 0;   // 0: not measured

  // The larger one of both floors divided by the other; 0 without both.
  [[nodiscard]] double drift() const noexcept;
  [[nodiscard]] bool isCalm() const noexcept { return drift() <= Result::kLargeDrift; }
};

class Rounds {
 public:
  void add(const Round& round) { rounds_.push_back(round); }
  // Of the round that was added last.
  void setFloorAfter(double ns) noexcept { rounds_.back().floorAfterNs = ns; }
  // The number of rounds in the largest group that agrees.
  [[nodiscard]] std::size_t agreeing() const { return agreeingRounds().size(); }
  // Sets the figures, the floor and the disturbance of the result.
  void writeTo(Result& result) const;

 private:
  [[nodiscard]] std::vector<Round> agreeingRounds() const;

  std::vector<Round> rounds_;
};

}  // namespace mpf::bench
