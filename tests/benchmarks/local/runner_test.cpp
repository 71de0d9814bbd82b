// SPDX-License-Identifier: MIT
#include "benchmarks/local/runner.h"

#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::bench {
namespace {

// A row that takes no time and returns the given costs one after the other.
Measurement costing(const std::string& name, std::vector<double> ns) {
  Measurement row;
  row.name = name;
  row.run = [ns, at = std::size_t{0}](const Stage&) mutable {
    Outcome outcome;
    outcome.figures.typicalNs = ns[at++ % ns.size()];
    return outcome;
  };
  return row;
}

TEST(Runner, DividesEachRoundByTheFloorOfThatRound) {
  const std::vector<Measurement> rows{costing("floor", {70, 500, 70})};
  auto row = costing("ours", {84, 600, 7000});  // near, far, and disturbed
  row.floorName = "floor";

  const auto result = Runner({}, rows).run(row, {}, 3);

  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.2);
  EXPECT_DOUBLE_EQ(result.floorNs, 70);
  EXPECT_DOUBLE_EQ(result.costNs(), 600);
}

TEST(Runner, DividesByTheLastFloorWithoutRounds) {
  const std::vector<Measurement> rows{costing("floor", {100, 999})};
  Runner runner({}, rows);
  auto row = costing("ours", {150});
  row.floorName = "floor";
  static_cast<void>(runner.run(row, {}, 1));

  const auto result = runner.run(row, {}, 0);

  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.5);
}

TEST(Runner, LeavesOutARowWhoseEnvironmentCannotStart) {
  const std::vector<Measurement> rows;
  auto row = costing("peer", {1});
  row.environmentName = "daemon";
  row.environment = []() -> std::unique_ptr<Environment> {
    throw std::runtime_error("not installed");
  };

  const auto result = Runner({}, rows).run(row, {}, 1);

  EXPECT_EQ(result.measurement.skipped, "not installed");
  EXPECT_EQ(result.error, "");
}

TEST(Runner, KeepsAnEnvironmentForRowsThatShareIt) {
  const std::vector<Measurement> rows;
  int started = 0;
  auto row = costing("peer", {1});
  row.environmentName = "daemon";
  row.environment = [&started] {
    ++started;
    return std::make_unique<Environment>();
  };
  Runner runner({}, rows);

  static_cast<void>(runner.run(row, {}, 0));
  static_cast<void>(runner.run(row, {}, 0));

  EXPECT_EQ(started, 1);
}

}  // namespace
}  // namespace mpf::bench
