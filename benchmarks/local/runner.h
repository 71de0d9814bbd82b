// SPDX-License-Identifier: MIT
// Runner: measures rows one after another, each beside its floor.
//
//   floor, row, floor, row, floor, row ...     ratio = median of the rounds' ratios
//
// A host may move the processors of a virtual machine at any time, and a cache line then needs
// 70 ns or 500 ns between the same two CPUs. A floor that was measured a minute ago cannot be
// compared, and so every round measures its floor again.
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
  // `all` must outlive the runner; it contains the floors.
  Runner(Placement placement, const std::vector<Measurement>& all) noexcept
      : placement_(std::move(placement)), all_(all) {}

  //   rounds  0: measure the row once, and divide it by the last measurement of its floor
  [[nodiscard]] Result run(Measurement row, Budget budget, int rounds);

 private:
  [[nodiscard]] std::string enter(const Measurement& row);
  [[nodiscard]] double measureFloor(const Measurement& row, Budget budget, int rounds);

  Placement placement_;
  const std::vector<Measurement>& all_;
  std::unique_ptr<Environment> environment_;  // of the last row; the next row may use it again
  std::string current_;
  std::map<std::string, std::string> missing_;
  // By setting, name and bytes [ns].
  std::map<std::tuple<std::string, std::string, std::size_t>, double> lastFloor_;
};

}  // namespace mpf::bench
