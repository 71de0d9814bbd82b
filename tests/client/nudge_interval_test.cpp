// SPDX-License-Identifier: MIT
#include "client/nudge_interval.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(NudgeInterval, IsDueAfterTheFirstInterval) {
  NudgeInterval interval;

  interval.start(1000);

  EXPECT_EQ(interval.dueNs(), 1000 + NudgeInterval::kFirstNs);
  EXPECT_FALSE(interval.tryTake(interval.dueNs() - 1));
  EXPECT_TRUE(interval.tryTake(interval.dueNs()));
}

TEST(NudgeInterval, DoublesUpToTheLastInterval) {
  NudgeInterval interval;
  interval.start(0);
  auto expectedNs = NudgeInterval::kFirstNs;

  for (int i = 0; i < 10; ++i) {
    const auto nowNs = interval.dueNs();
    ASSERT_TRUE(interval.tryTake(nowNs));
    expectedNs = std::min(2 * expectedNs, NudgeInterval::kLastNs);
    EXPECT_EQ(interval.dueNs(), nowNs + expectedNs);
  }
  EXPECT_EQ(expectedNs, NudgeInterval::kLastNs);
}

TEST(NudgeInterval, ResetBeginsWithTheFirstIntervalAfterTheLastRing) {
  NudgeInterval interval;
  interval.start(0);
  ASSERT_TRUE(interval.tryTake(NudgeInterval::kFirstNs));

  interval.reset();

  EXPECT_EQ(interval.dueNs(), 2 * NudgeInterval::kFirstNs);
}

}  // namespace
}  // namespace mpf::test
