// SPDX-License-Identifier: MIT
// replayedNs(): times of recordings at any speed.
#include "tools/tap/pace.h"

#include <gtest/gtest.h>

namespace mpf::tools {
namespace {

TEST(Pace, DividesByTheSpeed) {
  EXPECT_EQ(replayedNs(1000, 2), 500);
  EXPECT_EQ(replayedNs(-1000, 0.5), -2000);
}

// The times of a recording that is damaged may go back by any time.
TEST(Pace, IsLimitedInBothDirections) {
  constexpr auto kMost = std::int64_t{1} << 62;

  EXPECT_EQ(replayedNs(1000, 1e-300), kMost);
  EXPECT_EQ(replayedNs(-1000, 1e-300), -kMost);
}

}  // namespace
}  // namespace mpf::tools
