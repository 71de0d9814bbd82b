// SPDX-License-Identifier: MIT
// Rounds: the results of one row in several rounds, and which of them count.
//
// A host may move the processors of a virtual machine at any time, and a cache line then needs 70
// ns or 500 ns between the same two CPUs. A round of a row is calm if a cache line took about as
// long before and after the row as before and after its floor. Calm rounds agree if it took about
// as long in them, too. The largest group of rounds that agree counts, of equally large ones that
// with the faster lines; if no round was calm, all count.
//
// Threads  one.
#pragma once

#include <cstddef>
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

  [[nodiscard]] bool isCalm() const noexcept { return lines.drift() <= Result::kLargeLineDrift; }
};

class Rounds {
 public:
  void add(const Round& round) { rounds_.push_back(round); }
  // Of the round that was added last.
  void setFloorAfter(double ns) noexcept { rounds_.back().floorAfterNs = ns; }
  // The number of rounds in the largest group that agrees.
  [[nodiscard]] std::size_t agreeing() const { return agreeingRounds().size(); }
  // Sets the figures, the floor and what disturbed them.
  void writeTo(Result& result) const;

 private:
  [[nodiscard]] std::vector<Round> agreeingRounds() const;

  std::vector<Round> rounds_;
};

}  // namespace mpf::bench
