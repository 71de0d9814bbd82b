// SPDX-License-Identifier: MIT
#include "benchmarks/local/rounds.h"

#include <gtest/gtest.h>

namespace mpf::bench {
namespace {

// A round with these floors before and after it, in which a message cost `ns`.
Round costing(double ns, double before, double after, double takenNs = 0) {
  Round round;
  round.figures.typicalNs = ns;
  round.figures.latency.add(static_cast<std::uint64_t>(ns));
  round.disturbance = {takenNs, 100, 0};
  round.floorBeforeNs = before;
  round.floorAfterNs = after;
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
  const auto result = resultOf({costing(150, 100, 100), costing(500, 100, 400, 100)});

  EXPECT_EQ(result.rounds, 1u);
  EXPECT_DOUBLE_EQ(result.costNs(), 150);
  EXPECT_EQ(result.figures.latency.count(), 1u);
  EXPECT_DOUBLE_EQ(result.disturbance.share(), 0) << "only that of the round that counts";
  EXPECT_FALSE(result.hasFloorMoved());
}

TEST(Rounds, TheLargestGroupThatAgreesCounts) {
  const auto result =
      resultOf({costing(150, 100, 100), costing(450, 400, 400), costing(500, 410, 400)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_DOUBLE_EQ(result.floorNs, 405);
  EXPECT_DOUBLE_EQ(result.costNs(), 475);
}

TEST(Rounds, OfEqualGroupsTheOneWithTheLowerFloorCounts) {
  const auto result = resultOf({costing(450, 400, 400), costing(150, 100, 100)});

  EXPECT_DOUBLE_EQ(result.floorNs, 100);
  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.5);
}

TEST(Rounds, AllCountIfNoneWasCalm) {
  const auto result = resultOf({costing(150, 100, 400), costing(450, 400, 100)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_TRUE(result.hasFloorMoved());
}

TEST(Rounds, AFloorThatWasMeasuredOnceIsCalm) {
  EXPECT_EQ(resultOf({costing(150, 100, 0)}).rounds, 1u);
  EXPECT_DOUBLE_EQ(resultOf({costing(150, 0, 0)}).ratioToFloor, 0) << "no floor";
}

}  // namespace
}  // namespace mpf::bench
