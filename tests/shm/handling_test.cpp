// SPDX-License-Identifier: MIT
// Handling: one word holds a type and a cmd, or no request.
#include "shm/handling.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(HandlingTest, AWordHoldsTypeAndCmd) {
  for (const std::int32_t cmd : {0, 1, -1, INT32_MIN, INT32_MAX}) {
    const auto handling = Handling::of(Handling{UINT16_MAX, cmd}.word());

    ASSERT_TRUE(handling);
    EXPECT_EQ(handling->type, UINT16_MAX);
    EXPECT_EQ(handling->cmd, cmd);
  }
}

TEST(HandlingTest, AWordWithoutBit63MeansNoRequest) {
  EXPECT_FALSE(Handling::of(0));
  EXPECT_FALSE(Handling::of(UINT64_MAX >> 1));
  EXPECT_NE(Handling{}.word(), 0u);
}

}  // namespace
}  // namespace mpf::test
