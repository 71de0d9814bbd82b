// SPDX-License-Identifier: MIT
// Runner: takes rows one after another, each beside its floor.
//
//   floor, row, floor, row, floor, row ...     ratio = median of the rounds' ratios
//
// The same two CPUs may be near or far from each other from one moment to the next: a host moves
// the processors of a virtual machine about, and a cache line then takes 70 or 500 ns. So a floor
// that was measured a minute ago says nothing, and every round has its own.
//
// Threads  the runner's only one.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

class Runner {
 public:
  // `all` outlives the runner; floors are found there.
  Runner(Placement placement, const std::vector<Measurement>& all) noexcept
      : placement_(std::move(placement)), all_(all) {}

  //   rounds  0: measure the row once, and divide it by its floor as that was last measured
  [[nodiscard]] Result run(Measurement row, Budget budget, int rounds);

 private:
  [[nodiscard]] std::string enter(const Measurement& row);
  [[nodiscard]] double measureFloor(const Measurement& row, Budget budget, int rounds);

  Placement placement_;
  const std::vector<Measurement>& all_;
  std::unique_ptr<Environment> environment_;  // of the last row, for the next
  std::string current_;
  std::map<std::string, std::string> missing_;
  // by setting, name and bytes [ns]
  std::map<std::tuple<std::string, std::string, std::size_t>, double> lastFloor_;
};

}  // namespace mpf::bench
