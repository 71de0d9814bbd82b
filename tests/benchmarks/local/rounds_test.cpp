// SPDX-License-Identifier: MIT
#include "benchmarks/local/rounds.h"

#include <gtest/gtest.h>

namespace mpf::bench {
namespace {

// A round in which a message cost `ns`, and a cache line these times before and after it.
Round costing(double ns, double lineBefore, double lineAfter, double takenNs = 0) {
  Round round;
  round.figures.typicalNs = ns;
  round.figures.latency.add(static_cast<std::uint64_t>(ns));
  round.disturbance = {takenNs, 100, 0};
  round.lines.add(lineBefore);
  round.lines.add(lineAfter);
  round.floorBeforeNs = lineBefore;
  return round;
}

Result resultOf(const std::vector<Round>& all) {
  Rounds rounds;
  for (const auto& round : all) rounds.add(round);
  Result result;
  result.measurement.floorName = "floor";
  rounds.writeTo(result);
  return result;
}

TEST(Rounds, OnlyCalmRoundsCount) {
  const auto result = resultOf({costing(150, 100, 110), costing(500, 100, 400, 100)});

  EXPECT_EQ(result.rounds, 1u);
  EXPECT_DOUBLE_EQ(result.costNs(), 150);
  EXPECT_EQ(result.figures.latency.count(), 1u);
  EXPECT_DOUBLE_EQ(result.disturbance.share(), 0) << "only that of the round that counts";
  EXPECT_FALSE(result.haveLinesMoved());
}

TEST(Rounds, TheLargestGroupThatAgreesCounts) {
  const auto result =
      resultOf({costing(150, 100, 100), costing(450, 400, 400), costing(500, 410, 420)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_DOUBLE_EQ(result.floorNs, 405);
  EXPECT_DOUBLE_EQ(result.costNs(), 475);
}

TEST(Rounds, OfEqualGroupsTheOneWithTheFasterLinesCounts) {
  const auto result = resultOf({costing(450, 400, 400), costing(150, 100, 100)});

  EXPECT_DOUBLE_EQ(result.floorNs, 100);
  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.5);
}

TEST(Rounds, AllCountIfNoneWasCalm) {
  const auto result = resultOf({costing(150, 100, 400), costing(450, 400, 100)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_DOUBLE_EQ(result.lineDrift, 4);
  EXPECT_TRUE(result.haveLinesMoved() && result.isDisturbed());
}

TEST(Rounds, AllCountIfLinesWereNotTimed) {
  const auto result = resultOf({costing(150, 0, 0), costing(450, 0, 0)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_FALSE(result.isDisturbed());
}

TEST(Rounds, ShowHowFarTheFloorMoved) {
  auto round = costing(150, 100, 100);
  round.floorAfterNs = 50;

  EXPECT_DOUBLE_EQ(resultOf({round}).floorDrift, 2) << "during the round";
  EXPECT_TRUE(resultOf({round}).hasFloorMoved());
  EXPECT_DOUBLE_EQ(resultOf({costing(150, 100, 100), costing(200, 140, 140)}).floorDrift, 1.4)
      << "between rounds";
}

}  // namespace
}  // namespace mpf::bench
