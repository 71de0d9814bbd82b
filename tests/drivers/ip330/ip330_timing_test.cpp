// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_timing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

namespace mpf::test {
namespace {

using testing::HasSubstr;
using Mode = Ip330ScanMode;

struct TimerRow {
  Mode mode;
  int channels;
  double asked;
  int prescaler;
  int conversion;
  double made;
};

class Ip330TimerTest : public testing::TestWithParam<TimerRow> {};

TEST_P(Ip330TimerTest, GivesTheRequestedTime) {
  const auto& row = GetParam();

  const auto timer = ip330TimerOf(row.mode, row.channels, row.asked);

  EXPECT_EQ(timer.problem, "");
  EXPECT_EQ(timer.prescaler, row.prescaler);
  EXPECT_EQ(timer.conversion, row.conversion);
  EXPECT_DOUBLE_EQ(timer.microsecondsPerScan, row.made);
}

// The first two are the board of the manual: EPICS ip330 R1-4 needed 1240 and 1480 us instead of 1
// ms.
INSTANTIATE_TEST_SUITE_P(
    Table, Ip330TimerTest,
    testing::Values(
        TimerRow{Mode::burstContinuous, 16, 1000, 64, 95, 1000},
        TimerRow{Mode::burstContinuous, 32, 1000, 64, 65, 1000},
        TimerRow{Mode::burstContinuous, 1, 23, 64, 1, 23},
        TimerRow{Mode::burstContinuous, 1, 15 + 64 * 65535 / 8.0, 64, 65535, 15 + 64 * 65535 / 8.0},
        TimerRow{Mode::burstContinuous, 1, 1e6 + 15, 123, 65041, 15 + 123 * 65041 / 8.0},
        TimerRow{Mode::burstContinuous, 1, 15 + 255 * 65535 / 8.0, 255, 65535,
                 15 + 255 * 65535 / 8.0},
        TimerRow{Mode::uniformContinuous, 16, 16 * 64, 64, 8, 1024},
        TimerRow{Mode::uniformContinuous, 10, 10000, 64, 125, 10000},
        TimerRow{Mode::uniformSingle, 1, 16, 64, 2, 16}));

TEST(Ip330Timer, IsNotUsedWithTriggers) {
  for (const auto mode : {Mode::disable, Mode::burstSingle, Mode::convertOnExternalTriggerOnly}) {
    const auto timer = ip330TimerOf(mode, 4, 0);
    EXPECT_EQ(timer.problem, "");
    EXPECT_FALSE(timer.isUsed);
  }
}

TEST(Ip330Timer, RefusesImpossibleTimes) {
  EXPECT_THAT(ip330TimerOf(Mode::burstContinuous, 16, 247).problem, HasSubstr("use 248 to "));
  EXPECT_EQ(ip330TimerOf(Mode::burstContinuous, 16, 248).problem, "");
  EXPECT_THAT(ip330TimerOf(Mode::uniformContinuous, 16, 239).problem, HasSubstr("use 240 to "));
  EXPECT_THAT(ip330TimerOf(Mode::burstContinuous, 1, 2.1e6).problem, HasSubstr("to 2088943 us"));
  EXPECT_THAT(
      ip330TimerOf(Mode::uniformContinuous, 1, std::numeric_limits<double>::quiet_NaN()).problem,
      HasSubstr("use 15"));
}

}  // namespace
}  // namespace mpf::test
