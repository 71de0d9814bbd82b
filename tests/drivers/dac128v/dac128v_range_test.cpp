// SPDX-License-Identifier: MIT
#include <mpf/drivers/dac128v_range.h>

#include <gtest/gtest.h>
#include <limits>
#include <stdexcept>

namespace mpf::test {
namespace {

constexpr Dac128vRanges kMixedRanges{Dac128vRange{-10, 10}, Dac128vRange{0, 5}};

TEST(Dac128vRange, GivesTheNearestCode) {
  EXPECT_EQ(kMixedRanges[0].tryCodeOf(-2.5), 1536);
  EXPECT_EQ(kMixedRanges[1].tryCodeOf(1.25), 1024);
  EXPECT_EQ(kMixedRanges[1].tryCodeOf(-0.1), std::nullopt);
  EXPECT_EQ(kMixedRanges[0].tryCodeOf(10.1), std::nullopt);
  EXPECT_EQ(kMixedRanges[0].tryCodeOf(std::numeric_limits<double>::quiet_NaN()), std::nullopt);
}

TEST(Dac128vRanges, AcceptTheSettingsOfTheJumpers) {
  EXPECT_EQ(parseDac128vRanges("-10to10")[1], (Dac128vRange{-10, 10}));
  EXPECT_EQ(parseDac128vRanges("-5to+5,0to10")[1], (Dac128vRange{0, 10}));
  EXPECT_EQ(parseDac128vRanges("-5to+5,0to10")[0], (Dac128vRange{-5, 5}));
  for (const auto* const text :
       {"", "10", "10to-10", "0to0", "-3to3", "0to10,", "0to10,0to5,0to5", "0to10V"})
    EXPECT_THROW(static_cast<void>(parseDac128vRanges(text)), std::invalid_argument) << text;
}

}  // namespace
}  // namespace mpf::test
