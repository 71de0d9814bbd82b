// SPDX-License-Identifier: MIT
#include "benchmarks/local/rounds.h"

#include <array>
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

Rounds of(const std::vector<Round>& all) {
  Rounds rounds;
  for (const auto& round : all) rounds.add(round);
  return rounds;
}

// Of a row that is alone in its block.
Result resultOf(const std::vector<Round>& all) {
  const auto rounds = of(all);
  const std::array rows{&rounds};
  Result result;
  result.measurement.floorName = "floor";
  rounds.writeTo(result, chooseLines(rows, 3));
  return result;
}

TEST(Rounds, OnlyCalmRoundsCount) {
  const auto result = resultOf({costing(150, 100, 110), costing(500, 100, 400, 100)});

  EXPECT_EQ(result.rounds, 1u);
  EXPECT_DOUBLE_EQ(result.costNs(), 150);
  EXPECT_EQ(result.figures.latency.count(), 1u);
  EXPECT_DOUBLE_EQ(result.disturbance.share(), 0) << "only that of the round that counts";
  EXPECT_FALSE(result.haveLinesMoved);
}

TEST(Rounds, ThoseWithTheSameLinesCount) {
  const auto result =
      resultOf({costing(150, 100, 100), costing(450, 400, 400), costing(500, 410, 420)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_DOUBLE_EQ(result.floorNs, 405);
  EXPECT_DOUBLE_EQ(result.costNs(), 475);
}

TEST(Rounds, TheFasterLinesCountIfBothHaveAsManyRounds) {
  const auto result = resultOf({costing(450, 400, 400), costing(150, 100, 100)});

  EXPECT_DOUBLE_EQ(result.floorNs, 100);
  EXPECT_DOUBLE_EQ(result.ratioToFloor, 1.5);
}

TEST(Rounds, AllRowsOfABlockUseTheSameLines) {
  const auto near = costing(150, 100, 100);
  const auto far = costing(450, 400, 400);
  const auto moved = costing(300, 100, 400);
  const auto mostlyNear = of({near, near, near, far, far});
  const auto mostlyFar = of({moved, moved, near, far, far});
  const std::array rows{&mostlyNear, &mostlyFar};

  EXPECT_DOUBLE_EQ(chooseLines(rows, 2), 400) << "two rounds of each row; 100: two and one";
  EXPECT_DOUBLE_EQ(chooseLines(rows, 1), 100) << "one round of each row";
  EXPECT_EQ(fewestCalm(rows, 400), 2u);
  EXPECT_EQ(fewestCalm(rows, 100), 1u);
}

TEST(Rounds, ARowWithoutACalmRoundDoesNotChangeTheOthers) {
  const auto calm = of({costing(450, 400, 400), costing(450, 400, 400)});
  const auto never = of({costing(300, 40, 400), costing(300, 40, 400)});
  const std::array rows{&calm, &never};

  EXPECT_DOUBLE_EQ(chooseLines(rows, 3), 400);
}

TEST(Rounds, AllCountIfNoneWasCalm) {
  const auto result = resultOf({costing(150, 100, 400), costing(450, 400, 100)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_DOUBLE_EQ(result.lineDrift, 4);
  EXPECT_TRUE(result.haveLinesMoved && result.isDisturbed());
}

TEST(Rounds, ARowWithOtherLinesThanItsBlockIsDisturbed) {
  Result result;
  of({costing(450, 400, 400)}).writeTo(result, 100);

  EXPECT_EQ(result.rounds, 1u);
  EXPECT_DOUBLE_EQ(result.lineDrift, 4);
  EXPECT_TRUE(result.isDisturbed());
}

TEST(Rounds, ARoundWhoseFloorFailedIsNotDividedByIt) {
  auto failed = costing(150, 100, 100);
  failed.floorBeforeNs = 0;

  EXPECT_DOUBLE_EQ(resultOf({failed, costing(150, 100, 100)}).ratioToFloor, 1.5);
}

TEST(Rounds, AllCountIfLinesWereNotTimed) {
  const auto result = resultOf({costing(150, 0, 0), costing(450, 0, 0)});

  EXPECT_EQ(result.rounds, 2u);
  EXPECT_FALSE(result.isDisturbed());
}

// A round beside which the floor took these times.
Round withFloor(double before, double after = 0) {
  auto round = costing(150, 100, 100);
  round.floorBeforeNs = before;
  round.floorAfterNs = after;
  return round;
}

TEST(Rounds, ShowHowFarTheFloorMoved) {
  EXPECT_DOUBLE_EQ(resultOf({withFloor(100, 50)}).floorDrift, 2) << "during the round";
  EXPECT_DOUBLE_EQ(resultOf({withFloor(100), withFloor(140)}).floorDrift, 1.4) << "between rounds";
  EXPECT_DOUBLE_EQ(resultOf({withFloor(100), withFloor(110), withFloor(200)}).floorDrift, 1.1)
      << "most rounds agree";
}

}  // namespace
}  // namespace mpf::bench
