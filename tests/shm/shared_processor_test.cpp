// SPDX-License-Identifier: MIT
// SharedProcessor: what a wait that polls learns from giving its processor up.
#include "shm/shared_processor.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using Plan = SharedProcessor::Plan;

constexpr std::int64_t kAloneNs = 800;  // nobody else could run
constexpr std::int64_t kBriefNs = 10'000;
constexpr std::int64_t kStreamNs = 100'000;
constexpr std::int64_t kLongNs = 2'000'000;

class SharedProcessorTest : public testing::Test {
 protected:
  void noteYields(int number, std::int64_t ns, bool hasEvents) {
    for (int i = 0; i < number; ++i) processor_.noteYield(ns, hasEvents);
  }
  // The number of waits before one that yields; all of them have this plan.
  int countUntilYield(Plan plan) {
    for (int waits = 0;; ++waits) {
      const auto next = processor_.plan();
      if (next == Plan::yield) return waits;
      EXPECT_EQ(next, plan);
    }
  }

  SharedProcessor processor_;
};

TEST_F(SharedProcessorTest, KeepsItForSomeWaitsWhenOthersUseIt) {
  EXPECT_EQ(countUntilYield(Plan::keep), 0);

  processor_.noteYield(kLongNs, false);

  const auto first = countUntilYield(Plan::keep);
  EXPECT_GT(first, 0);
  noteYields(20, kLongNs, false);
  EXPECT_GT(countUntilYield(Plan::keep), 1000 * first) << "and yields less and less often";
}

TEST_F(SharedProcessorTest, YieldsAgainWhenOthersUseItBriefly) {
  processor_.noteYield(kLongNs, false);
  const auto first = countUntilYield(Plan::keep);
  noteYields(20, kLongNs, false);
  countUntilYield(Plan::keep);

  noteYields(2000, kAloneNs, false);

  EXPECT_EQ(countUntilYield(Plan::keep), 0);
  processor_.noteYield(kLongNs, false);
  EXPECT_EQ(countUntilYield(Plan::keep), first);
}

TEST_F(SharedProcessorTest, SleepsWhenOthersRanInVain) {
  noteYields(3, kBriefNs, false);
  EXPECT_EQ(countUntilYield(Plan::sleep), 0);

  processor_.noteYield(kBriefNs, false);

  EXPECT_EQ(countUntilYield(Plan::sleep), 63) << "then it tries again";
  EXPECT_EQ(countUntilYield(Plan::sleep), 63);
}

TEST_F(SharedProcessorTest, YieldsAgainOnceThatBroughtAMessage) {
  noteYields(10, kBriefNs, false);
  ASSERT_GT(countUntilYield(Plan::sleep), 0);

  processor_.noteYield(kBriefNs, true);

  noteYields(3, kBriefNs, false);
  EXPECT_EQ(countUntilYield(Plan::sleep), 0) << "as at first";
}

TEST_F(SharedProcessorTest, PollsWhenNobodyElseRunsOrOthersHaveMuchToDo) {
  noteYields(100, kAloneNs, false);
  EXPECT_EQ(countUntilYield(Plan::sleep), 0);

  noteYields(100, kStreamNs, false);
  EXPECT_EQ(countUntilYield(Plan::sleep), 0);
}

}  // namespace
}  // namespace mpf::test
