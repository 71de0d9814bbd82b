// SPDX-License-Identifier: MIT
// saturatingSum(), saturatingDifference(): at and beyond the limits of 64 bits.
#include "base/saturating.h"

#include <gtest/gtest.h>

namespace mpf {
namespace {

struct SaturatingTest : testing::Test {
  static constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
  static constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
};

TEST_F(SaturatingTest, IsExactWithinTheLimits) {
  EXPECT_EQ(saturatingSum(kMost - 1, 1), kMost);
  EXPECT_EQ(saturatingSum(kLeast, kMost), -1);
  EXPECT_EQ(saturatingDifference(kLeast + 1, 1), kLeast);
  EXPECT_EQ(saturatingDifference(-1, kLeast), kMost);
}

TEST_F(SaturatingTest, EndsAtTheLimits) {
  EXPECT_EQ(saturatingSum(kMost, 1), kMost);
  EXPECT_EQ(saturatingSum(kLeast, -1), kLeast);
  EXPECT_EQ(saturatingDifference(kMost, -1), kMost);
  EXPECT_EQ(saturatingDifference(0, kLeast), kMost);
  EXPECT_EQ(saturatingDifference(kLeast, 1), kLeast);
}

}  // namespace
}  // namespace mpf
