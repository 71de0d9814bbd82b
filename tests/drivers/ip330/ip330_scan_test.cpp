// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_scan.h"

#include <stdexcept>

#include "ip330_fixture.h"

namespace mpf::test {
namespace {

TEST(RunningMean, CoversTheNumberOfSamplesOfEachReader) {
  RunningMean mean;
  mean.reserve(1000);
  for (int i = 1; i <= 5000; ++i) mean.add(i);
  EXPECT_DOUBLE_EQ(mean.mean(1), 5000);
  EXPECT_DOUBLE_EQ(mean.mean(100), 4950.5);
  EXPECT_DOUBLE_EQ(mean.mean(1000), 4500.5);
}

TEST(RunningMean, KeepsItsSamplesWhenItGrows) {
  RunningMean mean;
  for (int i = 1; i <= 200; ++i) mean.add(-i);
  mean.reserve(10000);
  EXPECT_DOUBLE_EQ(mean.mean(10000), -(200 + 138) / 2.0);  // the last 63
  for (int i = 201; i <= 400; ++i) mean.add(-i);
  EXPECT_DOUBLE_EQ(mean.mean(200), -300.5);
  EXPECT_DOUBLE_EQ(mean.mean(10000), -(400 + 138) / 2.0);
}

TEST(RunningMean, CoversSamplesSinceTheRestartOnly) {
  RunningMean mean;
  for (int i = 0; i < 100; ++i) mean.add(7);
  mean.restart();
  mean.add(1);
  mean.add(2);
  EXPECT_DOUBLE_EQ(mean.mean(50), 1.5);
}

class Ip330ScanTest : public testing::Test {
 protected:
  // Code of channel 5 in sample n: 32768 + 100 n.
  void ramp() {
    with_.model.setSignal(5, [this](double) { return 1000.0 / 65536 * ++conversions_; });
  }
  int conversions_ = 0;
  Ip330Board with_{{.lastChannel = 7, .secondsBetweenCalibrate = 0}};
  Ip330Scan scan_{with_.board, 2, 5};
};

TEST_F(Ip330ScanTest, EachReaderHasItsOwnTime) {
  ramp();
  with_.scan(50);
  EXPECT_EQ(scan_.tryRead(5, 0, 1ms), 32768 + 5000);
  EXPECT_EQ(scan_.tryRead(5, 0, 11ms), 32768 + 4500);
  EXPECT_EQ(scan_.tryRead(5, 0, 1ms), 32768 + 5000);
  EXPECT_EQ(scan_.tryRead(5, 0, 51ms), 32768 + 2550);  // the mean of all samples
}

// EPICS ip330 R1-7 returned the corrected value of code 0 when no sample had come since the last
// reading.
TEST_F(Ip330ScanTest, WithoutATimeCoversAtLeastOneSampleSinceTheLastReading) {
  ramp();
  with_.scan(3);
  EXPECT_EQ(scan_.tryRead(5, 0, 0ms), 32768 + 200);
  EXPECT_EQ(scan_.tryRead(5, 0, 0ms), 32768 + 300);
  with_.scan(5);
  EXPECT_EQ(scan_.tryRead(5, 0, 0ms), 32768 + 600);
}

TEST_F(Ip330ScanTest, WaitsForTheFirstSample) {
  std::thread scanning([&] { with_.scan(1); });
  EXPECT_EQ(scan_.tryRead(2, 0, 0ms), 32768);
  scanning.join();
}

TEST_F(Ip330ScanTest, AfterAChangeOfGainWaitsForASampleWithIt) {
  with_.model.setSignal(3, dcSignal(0.5));
  with_.scan(5);
  EXPECT_NEAR(scan_.tryRead(3, 0, 100ms).value(), 32768 + 3277, 1);
  std::atomic<bool> isRead{false};
  std::thread scanning([&] {
    while (!isRead) with_.model.step();  // a change of the gain discards some scans
  });
  EXPECT_NEAR(scan_.tryRead(3, 2, 100ms).value(), 32768 + 4 * 3277, 2);
  isRead = true;
  scanning.join();
}

// Two readers want different gains and one gets its gain; no scan comes, so neither has a sample
// yet.
TEST_F(Ip330ScanTest, StopsWaitingWhenAnotherReaderChangesTheGain) {
  Ip330Scan other(with_.board, 2, 5);
  std::atomic<int> ended{0};
  std::optional<int> one;
  std::optional<int> two;
  std::thread reading([&] {
    one = scan_.tryRead(3, 0, 0ms);
    ++ended;
  });
  std::thread otherReading([&] {
    two = other.tryRead(3, 1, 0ms);
    ++ended;
  });
  while (ended.load() == 0) std::this_thread::yield();

  while (ended.load() < 2) with_.model.step();

  reading.join();
  otherReading.join();
  EXPECT_NE(one.has_value(), two.has_value());
}

TEST_F(Ip330ScanTest, RefusesInvalidArguments) {
  with_.scan(1);
  EXPECT_EQ(scan_.tryRead(1, 0, 0ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(6, 0, 0ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(INT32_MAX, 0, 0ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(3, 4, 0ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(3, -1, 0ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(3, 0, -1ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(3, 0, 65537ms), std::nullopt);
  EXPECT_EQ(scan_.tryRead(3, 0, 65536ms), 32768);
  EXPECT_THROW(Ip330Scan(with_.board, 0, 8), std::invalid_argument);
}

TEST_F(Ip330ScanTest, StopEndsAReadingThatWaits) {
  std::thread reading([&] { EXPECT_EQ(scan_.tryRead(2, 0, 0ms), std::nullopt); });
  scan_.stop();
  reading.join();
}

TEST_F(Ip330ScanTest, ReadsNothingWhenNothingIsScanned) {
  ASSERT_EQ(with_.board.tryConfigure(Ip330ScanMode::disable, Ip330Trigger::input, 1000), "");
  EXPECT_EQ(scan_.tryRead(2, 0, 0ms), std::nullopt);
}

TEST_F(Ip330ScanTest, ReadsNoSamplesFromBeforeAChangeOfMode) {
  ramp();
  with_.scan(3);
  EXPECT_EQ(scan_.tryRead(5, 0, 100ms), 32768 + 200);
  ASSERT_EQ(with_.board.tryConfigure(Ip330ScanMode::disable, Ip330Trigger::input, 1000), "");
  EXPECT_EQ(scan_.tryRead(5, 0, 100ms), std::nullopt);
  ASSERT_EQ(with_.board.tryConfigure(Ip330ScanMode::burstSingle, Ip330Trigger::input, 1000), "");
  EXPECT_EQ(scan_.tryRead(5, 0, 100ms), std::nullopt);
  const auto before = with_.board.counters().scans;
  ASSERT_TRUE(with_.board.tryStartConvert());
  while (with_.board.counters().scans == before) std::this_thread::yield();
  EXPECT_EQ(scan_.tryRead(5, 0, 0ms), 32768 + 400);
  EXPECT_EQ(scan_.tryRead(5, 0, 0ms), 32768 + 400);
  ASSERT_EQ(with_.board.tryConfigure(Ip330ScanMode::burstContinuous, Ip330Trigger::input, 2000),
            "");
  with_.scan(2);
  EXPECT_EQ(scan_.tryRead(5, 0, 100ms), 32768 + 550);
}

// With an offset of 200 codes, voltages just outside the range would have corrected codes outside 0
// to 0xffff.
TEST(Ip330Scan, GivesCodesWithinTheRange) {
  Ip330Board with({.secondsBetweenCalibrate = 0},
                  {.gainError = {-0.02}, .offsetError = {700}, .isRealTime = false});
  Ip330Scan scan(with.board, 0, 1);
  with.model.setSignal(0, dcSignal(-5.05));
  with.model.setSignal(1, dcSignal(5.05));
  with.scan(1);
  EXPECT_EQ(scan.tryRead(0, 0, 0ms), 0);
  EXPECT_EQ(scan.tryRead(1, 0, 0ms), 0xffff);
}

TEST(Ip330Scan, ReadsNothingFromAnAbsentBoard) {
  Ip330Board with({.secondsBetweenCalibrate = 0}, {.isRealTime = true}, kWatchful);
  Ip330Scan scan(with.board, 0, 1);
  with.carrier.unplug("IP_a");
  with.notes.waitFor("+the board is gone");
  EXPECT_EQ(scan.tryRead(0, 0, 0ms), std::nullopt);
}

}  // namespace
}  // namespace mpf::test
