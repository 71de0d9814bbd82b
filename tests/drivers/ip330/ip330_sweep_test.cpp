// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_sweep.h"

#include <cmath>
#include <stdexcept>

#include "ip330_fixture.h"

namespace mpf::test {
namespace {

using Points = std::vector<std::int32_t>;

class Ip330SweepTest : public testing::Test {
 protected:
  Ip330SweepTest() {
    for (int channel = 0; channel < 8; ++channel) {
      // The code in sample n is 32768 + 10 * channel + 100 n.
      with_.model.setSignal(channel, [this, channel](double) {
        return (100 * ++conversions_[static_cast<std::size_t>(channel)] + 10 * channel) * 10 /
               65536.0;
      });
    }
  }
  // The differences to the first code of the channel.
  Points read(int channel) {
    auto points = sweep_.tryRead(channel).value();
    for (auto& point : points) point -= point == 0 ? 0 : 32768 + 10 * channel;
    return points;
  }
  std::array<int, 8> conversions_{};
  Ip330Board with_{{.lastChannel = 7, .secondsBetweenCalibrate = 0}};
  Ip330Sweep sweep_{with_.board, 2, 5, 4};
};

TEST_F(Ip330SweepTest, RecordsAPointForEachScanUntilItIsFull) {
  with_.scan(1);
  sweep_.start();
  with_.scan(2);
  EXPECT_EQ(read(3), (Points{200, 300, 0, 0}));
  EXPECT_TRUE(sweep_.status().isAcquiring);
  with_.scan(2);
  EXPECT_FALSE(sweep_.status().isAcquiring);
  with_.scan(1);
  EXPECT_EQ(read(5), (Points{200, 300, 400, 500}));
  EXPECT_EQ(sweep_.status().acquired, 4);
}

// EPICS ip330Sweep omitted the last channel.
TEST_F(Ip330SweepTest, PointsAreMeansInEveryChannelTheLastIncluded) {
  ASSERT_TRUE(sweep_.trySetSecondsPerPoint(0.003));
  EXPECT_DOUBLE_EQ(sweep_.status().secondsPerPoint, 0.003);
  sweep_.start();
  with_.scan(6);
  for (int channel = 2; channel <= 5; ++channel)
    EXPECT_EQ(read(channel), (Points{200, 500, 0, 0})) << channel;
}

TEST_F(Ip330SweepTest, ContinuesAfterAStop) {
  sweep_.start();
  with_.scan(1);
  sweep_.stop();
  with_.scan(1);
  sweep_.start();
  with_.scan(1);
  EXPECT_EQ(read(2), (Points{100, 300, 0, 0}));
}

TEST_F(Ip330SweepTest, RestartsWhenErased) {
  sweep_.start();
  with_.scan(2);
  sweep_.erase();
  EXPECT_EQ(read(2), (Points{0, 0, 0, 0}));
  with_.scan(1);
  EXPECT_EQ(read(2), (Points{300, 0, 0, 0}));
}

TEST_F(Ip330SweepTest, HasTheGivenNumberOfPoints) {
  ASSERT_TRUE(sweep_.trySetPoints(2));
  sweep_.start();
  with_.scan(3);
  EXPECT_EQ(read(2), (Points{100, 200}));
  EXPECT_FALSE(sweep_.trySetPoints(0));
  EXPECT_FALSE(sweep_.trySetPoints(5));
  EXPECT_FALSE(sweep_.trySetPoints(NAN));
}

TEST_F(Ip330SweepTest, EndsAtThePresetTime) {
  ASSERT_TRUE(sweep_.trySetPreset(1e-9));
  sweep_.start();
  EXPECT_FALSE(sweep_.status().isAcquiring);
  EXPECT_GE(sweep_.status().elapsedSeconds, 1e-9);
  with_.scan(1);
  EXPECT_EQ(sweep_.status().acquired, 0);
}

TEST_F(Ip330SweepTest, RefusesInvalidArguments) {
  EXPECT_EQ(sweep_.tryRead(1), std::nullopt);
  EXPECT_EQ(sweep_.tryRead(6), std::nullopt);
  EXPECT_FALSE(sweep_.trySetSecondsPerPoint(-1));
  EXPECT_FALSE(sweep_.trySetPreset(INFINITY));
  EXPECT_THROW(Ip330Sweep(with_.board, 0, 8, 4), std::invalid_argument);
  EXPECT_THROW(Ip330Sweep(with_.board, 0, 7, 0), std::invalid_argument);
  // more points than a message can have
  EXPECT_THROW(Ip330Sweep(with_.board, 0, 7, 1 << 24), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
