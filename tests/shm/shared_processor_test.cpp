// SPDX-License-Identifier: MIT
// SharedProcessor: the plan of the next wait after yields of several durations.
#include "shm/shared_processor.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using Plan = SharedProcessor::Plan;

constexpr std::int64_t kAloneNs = 800;  // no other thread ran
constexpr std::int64_t kBriefNs = 10'000;
constexpr std::int64_t kStreamNs = 100'000;
constexpr std::int64_t kLongNs = 2'000'000;

class SharedProcessorTest : public testing::Test {
 protected:
  void noteYields(int number, std::int64_t ns, bool hasEvents = false) {
    for (int i = 0; i < number; ++i) processor_.noteYield(ns, hasEvents);
  }
  // Counts the waits before the next Plan::yield; each of them must have this plan.
  int countWaits(Plan plan) {
    for (int waits = 0;; ++waits) {
      const auto next = processor_.plan();
      if (next == Plan::yield) return waits;
      EXPECT_EQ(next, plan);
    }
  }

  SharedProcessor processor_;
};

TEST_F(SharedProcessorTest, KeepsTheProcessorAfterALongYield) {
  EXPECT_EQ(countWaits(Plan::keep), 0);

  noteYields(1, kLongNs);

  const auto first = countWaits(Plan::keep);
  EXPECT_GT(first, 0);
  noteYields(20, kLongNs);
  EXPECT_GT(countWaits(Plan::keep), 1000 * first) << "and longer after each further one";
}

TEST_F(SharedProcessorTest, YieldsAgainAfterShorterYields) {
  noteYields(1, kLongNs);
  const auto first = countWaits(Plan::keep);
  noteYields(20, kLongNs);
  countWaits(Plan::keep);

  noteYields(2000, kAloneNs);

  EXPECT_EQ(countWaits(Plan::keep), 0);
  noteYields(1, kLongNs);
  EXPECT_EQ(countWaits(Plan::keep), first);
}

TEST_F(SharedProcessorTest, SleepsAfterFourBriefYieldsWithoutAnEvent) {
  noteYields(3, kBriefNs);
  EXPECT_EQ(countWaits(Plan::sleep), 0);

  noteYields(1, kBriefNs);

  EXPECT_EQ(countWaits(Plan::sleep), 63) << "then it tries again";
  EXPECT_EQ(countWaits(Plan::sleep), 63);
}

TEST_F(SharedProcessorTest, PollsAgainAfterAYieldWithAnEvent) {
  noteYields(10, kBriefNs);

  noteYields(1, kBriefNs, true);

  EXPECT_EQ(countWaits(Plan::sleep), 0);
  noteYields(3, kBriefNs);
  EXPECT_EQ(countWaits(Plan::sleep), 0) << "it counts from the beginning";
}

TEST_F(SharedProcessorTest, PollsAgainAfterAnEventWithoutAYield) {
  noteYields(10, kBriefNs);

  processor_.notePolled();

  EXPECT_EQ(countWaits(Plan::sleep), 0);
}

TEST_F(SharedProcessorTest, PollsAgainWhenNoOtherThreadRuns) {
  noteYields(10, kBriefNs);

  noteYields(1, kAloneNs);

  EXPECT_EQ(countWaits(Plan::sleep), 0);
}

TEST_F(SharedProcessorTest, DoesNotCountTheYieldsOfAStream) {
  noteYields(100, kStreamNs);
  EXPECT_EQ(countWaits(Plan::sleep), 0);

  noteYields(3, kBriefNs);
  noteYields(1, kStreamNs);
  noteYields(1, kBriefNs);
  EXPECT_EQ(countWaits(Plan::sleep), 63) << "nor do they count as success";
}

}  // namespace
}  // namespace mpf::test
