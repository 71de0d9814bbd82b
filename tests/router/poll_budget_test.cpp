// SPDX-License-Identifier: MIT
// PollBudget: polls for as long as that is worth it.
#include "router/poll_budget.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using router::PollBudget;

constexpr auto kShort = PollBudget::kMaxNs - 1;
constexpr auto kLong = PollBudget::kMaxNs;

TEST(PollBudget, QuartersWithEachLongWait) {
  PollBudget budget;

  EXPECT_EQ(budget.ns(), PollBudget::kMaxNs);
  budget.noteWait(kLong);
  EXPECT_EQ(budget.ns(), PollBudget::kMaxNs / 4);
  for (int i = 0; i < 100; ++i) budget.noteWait(INT64_MAX);

  EXPECT_EQ(budget.ns(), PollBudget::kMaxNs / 64) << "at least";
}

TEST(PollBudget, DoublesWithEachShortWait) {
  PollBudget budget;
  for (int i = 0; i < 100; ++i) budget.noteWait(kLong);

  budget.noteWait(kShort);

  EXPECT_EQ(budget.ns(), PollBudget::kMaxNs / 32);
  for (int i = 0; i < 100; ++i) budget.noteWait(0);
  EXPECT_EQ(budget.ns(), PollBudget::kMaxNs) << "at most";
}

TEST(PollBudget, StaysSmallWhenEachReplyIsFollowedByALongWait) {
  PollBudget budget;

  for (int i = 0; i < 100; ++i) {
    budget.noteWait(kLong);
    budget.noteWait(kShort);
  }

  EXPECT_LE(budget.ns(), PollBudget::kMaxNs / 32);
}

}  // namespace
}  // namespace mpf::test
