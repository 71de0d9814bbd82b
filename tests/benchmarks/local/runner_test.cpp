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

Measurement over(const std::string& floor, Measurement row) {
  row.floorName = floor;
  return row;
}

Result runAlone(Runner& runner, const Measurement& row, int rounds) {
  return runner.run({{row, {}, rounds}}).front();
}

TEST(Runner, DividesEachRoundByTheFloorOfThatRound) {
  const std::vector<Measurement> rows{costing("floor", {70, 80, 75})};
  auto row = costing("ours", {84, 96, 7000});  // the last one is disturbed
  row.floorName = "floor";

  Runner runner({}, rows);

  const auto result = runAlone(runner, row, 3);

  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.2);
  EXPECT_DOUBLE_EQ(result.floorNs, 75);
  EXPECT_DOUBLE_EQ(result.costNs(), 96);
}

// How often a row is measured beside which a cache line takes these times: before its floor, after
// it, and after the row.
int timesMeasured(const std::vector<double>& lineNs, Result& result) {
  const std::vector<Measurement> rows{costing("floor", {100})};
  int times = 0;
  auto row = over("floor", costing("ours", {150}));
  row.run = [&times, run = row.run](const Stage& stage) {
    ++times;
    return run(stage);
  };
  const auto line = costing("line", lineNs);
  result = Runner({}, rows, &line).run({{row, {}, 3}}).front();
  return times;
}

TEST(Runner, RepeatsRoundsUntilEnoughAgree) {
  Result result;
  const auto times = timesMeasured({90, 95, 92,     // near
                                    90, 90, 400,    // moved during the row
                                    400, 400, 400,  // far
                                    400, 90, 90,    // moved during the floor
                                    90, 95, 92, 90, 95, 92},
                                   result);

  EXPECT_EQ(times, 6);
  EXPECT_EQ(result.rounds, 3u);
  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.5);
  EXPECT_FALSE(result.isDisturbed());
}

TEST(Runner, DoesNotRepeatCalmRounds) {
  Result result;

  EXPECT_EQ(timesMeasured({90}, result), 3);
}

TEST(Runner, EndsWhenCacheLinesMoveInEachRound) {
  Result result;
  const auto times = timesMeasured({100, 400, 100}, result);

  EXPECT_EQ(times, 3 * Runner::kMostTimes);
  EXPECT_TRUE(result.haveLinesMoved);
  EXPECT_EQ(result.rounds, static_cast<std::size_t>(times));
}

// The floor is measured before and after each round, and never between two rows.
TEST(Runner, ComparesTheRowsOfARoundWithOneFloor) {
  const std::vector<Measurement> rows{costing("floor", {100, 100, 110, 110, 120, 120})};
  const auto ours = over("floor", costing("ours", {150, 165, 180}));
  const auto theirs = over("floor", costing("theirs", {200, 220, 240}));
  const auto slow = over("floor", costing("slow", {1000}));

  const auto results = Runner({}, rows).run({{ours, {}, 3}, {theirs, {}, 3}, {slow, {}, 1}});

  ASSERT_EQ(results.size(), 3u);
  EXPECT_DOUBLE_EQ(results[0].ratioToFloor, 1.5);
  EXPECT_DOUBLE_EQ(results[1].ratioToFloor, 2);
  EXPECT_DOUBLE_EQ(results[2].ratioToFloor, 10) << "measured in the first round only";
  for (const auto& result : results) EXPECT_FALSE(result.hasFloorMoved());
}

TEST(Runner, MeasuresTheRowsOfABlockInTurn) {
  const std::vector<Measurement> rows;
  std::string order;
  const auto noting = [&](char name) {
    Measurement row;
    row.run = [&order, name](const Stage&) {
      order += name;
      return Outcome{};
    };
    return row;
  };

  static_cast<void>(Runner({}, rows).run({{noting('a'), {}, 2}, {noting('b'), {}, 2}}));

  EXPECT_EQ(order, "abab");
}

TEST(Runner, SaysWhenTheFloorMovedDuringARound) {
  const std::vector<Measurement> rows{costing("steady", {100}), costing("moved", {100, 400})};
  const auto ours = over("steady", costing("ours", {150}));
  const auto theirs = over("moved", costing("theirs", {150}));

  const auto results = Runner({}, rows).run({{ours, {}, 1}, {theirs, {}, 1}});

  EXPECT_FALSE(results[0].hasFloorMoved());
  EXPECT_TRUE(results[1].hasFloorMoved());
  EXPECT_DOUBLE_EQ(results[1].floorDrift, 4);
}

TEST(Runner, FailsOnlyTheRowThatFails) {
  const std::vector<Measurement> rows;
  auto failing = costing("failing", {1});
  failing.run = [](const Stage&) { return Outcome{{}, "it hangs"}; };

  const auto results = Runner({}, rows).run({{failing, {}, 3}, {costing("ours", {5}), {}, 3}});

  EXPECT_EQ(results[0].error, "it hangs");
  EXPECT_EQ(results[1].error, "");
  EXPECT_DOUBLE_EQ(results[1].costNs(), 5);
}

TEST(Runner, LeavesOutARowWhoseEnvironmentCannotStart) {
  const std::vector<Measurement> rows;
  auto row = costing("peer", {1});
  row.environmentName = "daemon";
  row.environment = []() -> std::unique_ptr<Environment> {
    throw std::runtime_error("not installed");
  };

  Runner runner({}, rows);

  const auto result = runAlone(runner, row, 1);

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

  static_cast<void>(runAlone(runner, row, 1));
  static_cast<void>(runAlone(runner, row, 1));

  EXPECT_EQ(started, 1);
}

}  // namespace
}  // namespace mpf::bench
