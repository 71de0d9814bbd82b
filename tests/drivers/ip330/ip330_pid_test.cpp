// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_pid.h"

#include <atomic>
#include <cmath>

#include "ip330_fixture.h"

namespace mpf::test {
namespace {

// An output of 12 bits and -10 to 10 V. Threads: any.
class FakeOutput final : public AnalogOutput {
 public:
  std::optional<double> tryRead() override {
    return answers ? std::optional(code.load()) : std::nullopt;
  }
  bool tryWrite(double wanted) override {
    if (answers) code = std::round(wanted);
    if (answers) ++writes;
    return answers;
  }
  std::atomic<double> code{2048};
  std::atomic<int> writes{0};
  std::atomic<bool> answers{true};
};

class Ip330PidTest : public testing::Test {
 protected:
  // The voltage at channel 1 is a quarter of the output plus 0.2 V.
  Ip330PidTest() {
    with_.model.setSignal(1,
                          [this](double) { return 0.2 + (output_.code - 2048) * 20 / 4096 / 4; });
    pid_.set([](PidLoop& loop) {
      loop.kp = 0.05;
      loop.ki = 100;
      loop.setPoint = 40000;
    });
  }
  FakeOutput output_;
  Ip330Board with_{{.lastChannel = 3, .secondsBetweenCalibrate = 0}};
  Notes outputNotes_;
  Ip330Pid pid_{with_.board, 1, output_, 0, 4095, outputNotes_.hook()};
};

TEST_F(Ip330PidTest, DoesNotWriteTheOutputUntilItIsStarted) {
  with_.scan(5);
  EXPECT_EQ(output_.writes, 0);
  EXPECT_NEAR(pid_.status().terms.actual, 32768 + 1311, 1);
  EXPECT_NEAR(pid_.status().terms.error, 40000 - 34079, 1);
}

TEST_F(Ip330PidTest, BringsTheInputToTheSetPoint) {
  pid_.start();
  with_.scan(300);
  EXPECT_NEAR(pid_.status().terms.actual, 40000, 10);  // a step of the output is 8 codes
  pid_.stop();
  const int writes = output_.writes;
  with_.scan(3);
  EXPECT_EQ(output_.writes, writes);
}

TEST_F(Ip330PidTest, StepsWithTheGivenPeriod) {
  ASSERT_TRUE(pid_.trySetSecondsPerScan(0.004));
  EXPECT_DOUBLE_EQ(pid_.status().secondsPerScan, 4 * with_.board.microsecondsPerScan() / 1e6);
  pid_.start();
  with_.scan(12);
  EXPECT_EQ(output_.writes, 3);
  EXPECT_FALSE(pid_.trySetSecondsPerScan(NAN));
  EXPECT_FALSE(pid_.trySetSecondsPerScan(-1));
}

// Gain code 1 of the converter has such a large error that it cannot be calibrated.
TEST(Ip330Pid, ReportsThatItsChannelIsNotCalibrated) {
  FakeOutput output;
  Ip330Board with({.lastChannel = 3, .secondsBetweenCalibrate = 0},
                  {.gainError = {-0.5}, .isRealTime = false});
  Ip330Pid pid(with.board, 1, output, 0, 4095);
  with.scan(1);
  EXPECT_FALSE(pid.status().isGood);
  ASSERT_TRUE(with.board.trySetGain(1, 1));
  with.scan(1);
  EXPECT_TRUE(pid.status().isGood);
}

TEST_F(Ip330PidTest, ReportsAFailedOutputAndContinuesFromItsLaterValue) {
  output_.answers = false;
  pid_.start();
  with_.scan(2);
  EXPECT_TRUE(outputNotes_.has("+the output"));
  EXPECT_FALSE(pid_.status().isGood);
  output_.answers = true;
  output_.code = 3000;
  with_.scan(1);
  EXPECT_TRUE(outputNotes_.has("-the output"));
  EXPECT_DOUBLE_EQ(pid_.status().terms.i, 3000);
  EXPECT_TRUE(pid_.status().isGood);
}

}  // namespace
}  // namespace mpf::test
