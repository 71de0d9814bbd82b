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

}  // namespace
}  // namespace mpf::test
