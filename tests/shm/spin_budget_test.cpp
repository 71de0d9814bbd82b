// SPDX-License-Identifier: MIT
// SpinBudget: follows the duration of wake-ups, and shrinks while sleeps are long.
#include "shm/spin_budget.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

void noteWakes(SpinBudget& budget, std::int64_t ns) {
  for (int i = 0; i < 1000; ++i) budget.noteWake(ns);
}

TEST(SpinBudget, IsAboutTwiceTheDurationOfAWakeUp) {
  SpinBudget budget;

  noteWakes(budget, 50'000);

  EXPECT_NEAR(static_cast<double>(budget.ns()), 100'000, 1000);
}

TEST(SpinBudget, LimitsDurationsThatPeersReport) {
  SpinBudget budget;

  noteWakes(budget, INT64_MAX);

  EXPECT_LE(budget.ns(), 2'000'000);
}

TEST(SpinBudget, HalvesWithEachLongSleepUntilOneIsShort) {
  SpinBudget budget;
  const auto full = budget.ns();

  budget.noteSleep(1'000'000'000);
  EXPECT_EQ(budget.ns(), full / 2);
  for (int i = 0; i < 100; ++i) budget.noteSleep(1'000'000'000);
  EXPECT_EQ(budget.ns(), full / 32) << "at least";
  budget.noteSleep(0);

  EXPECT_EQ(budget.ns(), full);
}

// The number of waits that keep the processor.
int countKeeps(SpinBudget& budget) {
  int keeps = 0;
  while (!budget.takeYielding()) ++keeps;
  return keeps;
}

constexpr std::int64_t kLong = 2'000'000;

TEST(SpinBudget, KeepsTheProcessorForSomeWaitsWhenOthersUseIt) {
  SpinBudget budget;
  EXPECT_EQ(countKeeps(budget), 0);

  budget.noteYield(kLong);

  const auto first = countKeeps(budget);
  EXPECT_GT(first, 0);
  EXPECT_TRUE(budget.takeYielding()) << "then it tries again";
  for (int i = 0; i < 20; ++i) budget.noteYield(kLong);
  EXPECT_GT(countKeeps(budget), 1000 * first) << "and less and less often";
}

TEST(SpinBudget, GivesTheProcessorUpAgainWhenOthersUseItBriefly) {
  SpinBudget budget;
  budget.noteYield(kLong);
  const auto first = countKeeps(budget);
  for (int i = 0; i < 20; ++i) budget.noteYield(kLong);
  countKeeps(budget);

  for (int i = 0; i < 2000; ++i) budget.noteYield(100);

  EXPECT_EQ(countKeeps(budget), 0);
  budget.noteYield(kLong);
  EXPECT_EQ(countKeeps(budget), first);
}

}  // namespace
}  // namespace mpf::test
