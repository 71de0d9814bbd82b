// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ip330_fixture.h"

namespace mpf::test {
namespace {

constexpr int kTestVoltages = 16;

struct CalibrationCase {
  Ip330Type type;
  Ip330Range range;
  int gain;
  double sign;  // sign of the converter's errors
};

std::vector<CalibrationCase> allCases() {
  std::vector<CalibrationCase> cases;
  for (const auto type : {Ip330Type::singleEnded, Ip330Type::differential}) {
    for (const auto range : {Ip330Range::minus5to5, Ip330Range::minus10to10, Ip330Range::from0to5,
                             Ip330Range::from0to10}) {
      for (int gain = 0; gain < kIp330Gains; ++gain) {
        for (const double sign : {1, -1}) cases.push_back({type, range, gain, sign});
      }
    }
  }
  return cases;
}

std::string nameOf(const testing::TestParamInfo<CalibrationCase>& info) {
  std::string name = info.param.type == Ip330Type::differential ? "D" : "S";
  name += toString(info.param.range);
  std::ranges::replace(name, '-', 'm');
  return name + "gain" + std::to_string(info.param.gain) + (info.param.sign > 0 ? "plus" : "minus");
}

std::array<double, kIp330Gains> times(double factor, std::array<double, kIp330Gains> values) {
  for (auto& value : values) value *= factor;
  return values;
}

// The error of such a converter cannot be measured: the only other voltage in the range is 0 V, the
// end of the range.
bool cannotBeCalibrated(Ip330Range range, int gain, double offset) {
  return range == Ip330Range::from0to5 && gain == 3 && offset < 1;
}

// Voltages in the inner 96 % of the input range: at the ends, a converter with errors runs out of
// codes.
double voltageOf(Ip330Range range, int gain, int number) {
  const auto [zero, span] = spanOf(range);
  return (zero + span * (0.02 + 0.96 * number / (kTestVoltages - 1))) /
         kIp330Gain[static_cast<std::size_t>(gain)];
}

class Ip330CalibrationTest : public testing::TestWithParam<CalibrationCase> {};

// For each test voltage, the mean of enough samples to remove the noise of the converter.
std::array<double, kTestVoltages> meansOf(Ip330Board& with, int scans) {
  std::array<double, kTestVoltages> sums{};
  {
    const auto subscription = with.board.subscribe([&](const Ip330Sample& sample) {
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += sample.corrected[i];
    });
    with.scan(scans);
  }
  for (auto& sum : sums) sum /= scans;
  return sums;
}

TEST_P(Ip330CalibrationTest, CorrectsTheCodesToWithinOneAndAHalf) {
  const auto& [type, range, gain, sign] = GetParam();
  const auto offsets = times(sign, {-70, 55, -40, 90});
  Ip330Board with({.type = type, .range = range, .secondsBetweenCalibrate = 0},
                  {.range = range,
                   .gainError = times(sign, {0.009, -0.009, 0.008, -0.006}),
                   .offsetError = offsets,
                   .noise = 0.4,
                   .seed = 7,
                   .isRealTime = false});
  if (cannotBeCalibrated(range, gain, offsets[static_cast<std::size_t>(gain)])) {
    EXPECT_FALSE(with.board.trySetGain(0, gain));
    EXPECT_TRUE(
        with.notes.has("+calibration fails: the converter gives no codes, implausible codes, or "
                       "the end of its range"));
    return;
  }
  for (int i = 0; i < kTestVoltages; ++i) {
    ASSERT_TRUE(with.board.trySetGain(i, gain));
    with.model.setSignal(i, dcSignal(voltageOf(range, gain, i)));
  }

  const auto means = meansOf(with, 50);

  for (int i = 0; i < kTestVoltages; ++i) {
    const double ideal = Ip330Model::idealCode(range, gain, voltageOf(range, gain, i));
    EXPECT_NEAR(clampedCode(means[static_cast<std::size_t>(i)]), ideal, 1.5)
        << voltageOf(range, gain, i) << " V";
  }
}

INSTANTIATE_TEST_SUITE_P(Each, Ip330CalibrationTest, testing::ValuesIn(allCases()), nameOf);

TEST(Ip330Correction, IsZeroForAPerfectConverter) {
  for (const auto& [type, range, gain, sign] : allCases()) {
    if (cannotBeCalibrated(range, gain, 0)) continue;
    const auto [low, high] = calibrationPointsOf(range, gain);
    const auto correction = correctionOf(range, gain, Ip330Model::idealCode(range, gain, low.volts),
                                         Ip330Model::idealCode(range, gain, high.volts));
    ASSERT_TRUE(correction);
    EXPECT_NEAR(correction->slope, 1, 1e-12);
    EXPECT_NEAR(correction->offset, 0, 1e-9);
  }
}

TEST(Ip330Correction, RefusesImplausibleCodes) {
  EXPECT_FALSE(correctionOf(Ip330Range::minus5to5, 0, 65535, 65535));  // an absent board
  EXPECT_FALSE(correctionOf(Ip330Range::minus5to5, 0, 0, 0));
  EXPECT_FALSE(correctionOf(Ip330Range::minus5to5, 0, 40000, 30000));
  EXPECT_FALSE(correctionOf(Ip330Range::minus5to5, 0, 33000, 65535));
  EXPECT_FALSE(correctionOf(Ip330Range::minus5to5, 0, 32768, 50000));  // half of the right slope
  // the offset may be any value below 0
  EXPECT_FALSE(correctionOf(Ip330Range::from0to5, 3, 0, 64225));
  EXPECT_FALSE(correctionOf(Ip330Range::from0to5, 3, 90, 65535));
  EXPECT_TRUE(correctionOf(Ip330Range::from0to5, 3, 90, 64315));
}

TEST(Ip330Correction, GivesClientsCodesWithinTheRange) {
  EXPECT_EQ(clampedCode(-0.6), 0);
  EXPECT_EQ(clampedCode(-1e6), 0);
  EXPECT_EQ(clampedCode(0.5), 1);
  EXPECT_EQ(clampedCode(65535.4), 0xffff);
  EXPECT_EQ(clampedCode(1e6), 0xffff);
}

TEST(Ip330Calibration, IsNotDoneWithANegativePeriod) {
  Ip330Board with({.secondsBetweenCalibrate = -1}, {.offsetError = {100}, .isRealTime = false});

  EXPECT_NEAR(meansOf(with, 1)[0], 32868, 0);
  EXPECT_EQ(with.board.counters().calibrations, 0u);
}

TEST(Ip330Calibration, IsRepeatedOnRequest) {
  Ip330Board with({.secondsBetweenCalibrate = -1}, {.offsetError = {100}, .isRealTime = false});

  EXPECT_TRUE(with.board.trySetSecondsBetweenCalibrate(0));

  EXPECT_EQ(with.board.counters().calibrations, 1u);
  EXPECT_NEAR(meansOf(with, 1)[0], 32768, 1);
  EXPECT_TRUE(with.board.tryCalibrate());
  EXPECT_EQ(with.board.counters().calibrations, 2u);
}

TEST(Ip330Calibration, IsRepeatedPeriodically) {
  Ip330Board with({.secondsBetweenCalibrate = 1}, {.isRealTime = false}, kWatchful);

  while (with.board.counters().calibrations < 3) std::this_thread::yield();
}

TEST(Ip330Calibration, OfACalibratedGainNeedsNoMeasurement) {
  Ip330Board with({.secondsBetweenCalibrate = 0});
  EXPECT_TRUE(with.board.trySetGain(0, 1));
  const auto before = with.board.counters().calibrations;

  EXPECT_TRUE(with.board.trySetGain(0, 0));
  EXPECT_TRUE(with.board.trySetGain(1, 1));

  EXPECT_EQ(with.board.counters().calibrations, before);
}

TEST(Ip330Calibration, ThatNeverEndsIsReportedAndTheBoardContinues) {
  Ip330Board with({.secondsBetweenCalibrate = 0}, {.isRealTime = false},
                  {.conversion = 1ms, .silence = 1h, .lookEvery = 1h});
  with.model.setStuck(true);

  EXPECT_FALSE(with.board.tryCalibrate());

  EXPECT_TRUE(with.notes.has("+calibration fails"));
  with.model.setStuck(false);
  with.scan(1);  // the converter settles
  EXPECT_NEAR(meansOf(with, 2)[0], 32768, 1);  // with the previous calibration
  EXPECT_TRUE(with.board.tryCalibrate());
  EXPECT_TRUE(with.notes.has("-calibration succeeds"));
}

// A gain that is not in use fails; the other gains must not be calibrated repeatedly because of it.
TEST(Ip330Calibration, ThatFailsForAGainLeavesTheChannelUnchanged) {
  Ip330Board with(
      {.range = Ip330Range::from0to5, .secondsBetweenCalibrate = 0},
      {.range = Ip330Range::from0to5, .offsetError = {5, 5, 5, -20}, .isRealTime = false});
  with.model.setSignal(0, dcSignal(2.5));

  EXPECT_FALSE(with.board.trySetGain(0, 3));

  EXPECT_EQ(with.board.gain(0), 0);
  EXPECT_NEAR(meansOf(with, 2)[0], 32768, 1);
  const auto before = with.board.counters().calibrations;
  EXPECT_FALSE(with.board.trySetGain(0, 3));
  EXPECT_EQ(with.board.counters().calibrations, before);
  EXPECT_TRUE(with.board.tryCalibrate());
  EXPECT_TRUE(with.notes.has("-calibration succeeds"));
}

TEST(Ip330Calibration, ThatFailsForOneGainDoesNotPreventTheOtherGains) {
  Ip330Board with({.secondsBetweenCalibrate = -1},
                  {.gainError = {-0.5}, .offsetError = {0, 40}, .isRealTime = false});
  ASSERT_TRUE(with.board.trySetGain(1, 1));

  EXPECT_FALSE(with.board.trySetSecondsBetweenCalibrate(0));

  Ip330Sample last;
  {
    const auto subscription =
        with.board.subscribe([&](const Ip330Sample& sample) { last = sample; });
    with.scan(1);
  }
  EXPECT_FALSE(last.isValid(0));
  EXPECT_TRUE(last.isValid(1));
  EXPECT_NEAR(last.corrected[1], 32768, 1);
}

TEST(Ip330Calibration, IsRetriedUntilItSucceeds) {
  Ip330Board with({.secondsBetweenCalibrate = 0}, {.isRealTime = true}, kWatchful);
  with.model.setStuck(true);
  EXPECT_FALSE(with.board.trySetGain(0, 2));
  with.model.setStuck(false);

  with.notes.waitFor("-calibration succeeds");

  EXPECT_TRUE(with.board.trySetGain(0, 2));
}

// Calibration, changes of gain and scans at the same time: no sample has codes of a calibration
// voltage, or of a gain other than the one that it reports.
TEST(Ip330Calibration, DoesNotMixWithScans) {
  Ip330Board with({.type = Ip330Type::differential,
                   .lastChannel = 3,
                   .microsecondsPerScan = 300,
                   .secondsBetweenCalibrate = 0},
                  {.isRealTime = true}, {.conversion = 1h, .silence = 1h, .lookEvery = 1h});
  for (int i = 0; i < 4; ++i) with.model.setSignal(i, dcSignal(0.3));
  ASSERT_EQ(with.board.tryConfigure(Ip330ScanMode::burstContinuous, Ip330Trigger::input, 300), "");
  std::atomic<int> samples{0};
  std::atomic<int> wrong{0};
  const auto subscription =
      with.board.subscribe([&, epoch = with.board.epoch()](const Ip330Sample& sample) {
        if (sample.epoch != epoch) return;  // from before the signals were set
        for (int i = 0; i < 4; ++i) {
          const auto at = static_cast<std::size_t>(i);
          if (std::abs(sample.corrected[at] -
                       Ip330Model::idealCode(Ip330Range::minus5to5, sample.gain[at], 0.3)) > 1.5)
            wrong.fetch_add(1);
        }
        samples.fetch_add(1);
      });

  for (int i = 0; samples.load() < 300; ++i) {
    const bool isCalibrated = i % 3 != 0 || with.board.tryCalibrate();
    EXPECT_TRUE(isCalibrated);
    EXPECT_TRUE(with.board.trySetGain(i % 4, i % 3));
    const int before = samples.load();
    while (samples.load() == before) std::this_thread::yield();
  }

  EXPECT_EQ(wrong.load(), 0);
}

}  // namespace
}  // namespace mpf::test
