// SPDX-License-Identifier: MIT
// The registers of the chip with the device model, without threads: mailboxes, flags, halves.
#include "drivers/ip330/ip330_chip.h"

#include <gtest/gtest.h>

#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/ip330/ip330_model.h"
#include "drivers/ip330/ip330_registers.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class Ip330ChipTest : public testing::Test {
 protected:
  void start(Ip330Type type, Ip330ScanMode mode = Ip330ScanMode::burstContinuous) {
    settings_ = {
        .type = type, .firstChannel = 2, .lastChannel = 7, .vector = 0x5a, .scanMode = mode};
    chip_.start(settings_, gains_, 1h);
    // The codes of each scan are 100 higher than those of the previous scan.
    model_.setSignal(7, [this](double) { return -5 + ++conversions_ * 100 * 10 / 65536.0; });
  }
  std::vector<int> take() {
    chip_.take(settings_, scans_);
    std::vector<int> codes;
    for (std::size_t i = 0; i < scans_.count; ++i) codes.push_back(scans_.codes[i][7]);
    return codes;
  }

  Watchdog watchdog_{"ip330 chip test"};
  ModelCarrier carrier_;
  Ip330Model& model_ =
      carrier_.plug("IP_a", std::make_unique<Ip330Model>(Ip330ModelOptions{.isRealTime = false}));
  Registers& io_ = carrier_.site(0).io();
  Ip330Chip chip_{io_};
  Ip330Settings settings_;
  std::array<std::uint8_t, kIp330Channels> gains_{};
  Ip330Chip::Scans scans_;
  int conversions_ = 0;
};

using Codes = std::vector<int>;

TEST_F(Ip330ChipTest, WritesAllSettings) {
  gains_[7] = 3;

  start(Ip330Type::singleEnded);

  // interrupt after all channels, timer, burst continuous, single ended, straight binary
  EXPECT_EQ(io_.read16(ip330::kControl), 0x2b0a);
  EXPECT_EQ(io_.read8(ip330::kTimerPrescaler), 64);
  EXPECT_EQ(io_.read8(ip330::kInterruptVector), 0x5a);
  EXPECT_EQ(io_.read16(ip330::kConversionTimer), 114);  // 1000 us less 6 conversions
  EXPECT_EQ(io_.read8(ip330::kStartChannel), 2);
  EXPECT_EQ(io_.read8(ip330::kEndChannel), 7);
  EXPECT_EQ(io_.read8(ip330::kGainSelect + 7), 3);
  EXPECT_EQ(chip_.presence(), Ip330Chip::Presence::asProgrammed);
}

TEST_F(Ip330ChipTest, TakesEachScanOnce) {
  start(Ip330Type::singleEnded);
  EXPECT_EQ(take(), Codes{});
  model_.step();
  EXPECT_EQ(take(), Codes{100});
  EXPECT_EQ(take(), Codes{});
  model_.step();
  EXPECT_EQ(take(), Codes{200});
  EXPECT_FALSE(scans_.isMissing);
}

TEST_F(Ip330ChipTest, ReportsAnOverwrittenScan) {
  start(Ip330Type::singleEnded);
  model_.step(2);
  EXPECT_EQ(take(), Codes{200});
  EXPECT_TRUE(scans_.isMissing);
}

TEST_F(Ip330ChipTest, ReadsBothHalvesOfTheMailboxesInTurn) {
  start(Ip330Type::differential);
  for (int i = 1; i <= 5; ++i) {
    model_.step();
    EXPECT_EQ(take(), Codes{100 * i});
    EXPECT_FALSE(scans_.isMissing);
  }
}

TEST_F(Ip330ChipTest, TakesTwoScansThatWaitInBothHalves) {
  start(Ip330Type::differential);
  model_.step();
  EXPECT_EQ(take(), Codes{100});
  model_.step(2);
  EXPECT_EQ(take(), (Codes{200, 300}));
  model_.step(1);
  EXPECT_EQ(take(), Codes{400});
}

TEST_F(Ip330ChipTest, DoesNotLoseTheHalvesWhenScansWereOverwritten) {
  start(Ip330Type::differential);
  model_.step(3);
  EXPECT_EQ(take().size(), 2u);
  EXPECT_TRUE(scans_.isMissing);
  for (int i = 4; i <= 7; ++i) {
    model_.step();
    EXPECT_EQ(take(), Codes{100 * i});
  }
}

TEST_F(Ip330ChipTest, ReadsTheLowerHalfAloneInSingleModes) {
  start(Ip330Type::differential, Ip330ScanMode::burstSingle);
  for (int i = 1; i <= 3; ++i) {
    chip_.startConvert();
    EXPECT_EQ(take(), Codes{100 * i});
  }
}

TEST_F(Ip330ChipTest, AnExternalTriggerScans) {
  start(Ip330Type::singleEnded, Ip330ScanMode::uniformSingle);
  model_.externalTrigger();
  EXPECT_EQ(take(), Codes{100});
}

TEST_F(Ip330ChipTest, AnExternalTriggerConvertsOneChannelInMode5) {
  start(Ip330Type::singleEnded, Ip330ScanMode::convertOnExternalTriggerOnly);
  for (int i = 0; i < 5; ++i) model_.externalTrigger();
  EXPECT_EQ(take(), Codes{});
  model_.externalTrigger();
  EXPECT_EQ(take(), Codes{100});
}

TEST_F(Ip330ChipTest, DoesNotScanWhenDisabled) {
  start(Ip330Type::singleEnded, Ip330ScanMode::disable);
  model_.step(3);
  EXPECT_EQ(take(), Codes{});
}

TEST_F(Ip330ChipTest, MeasuresACalibrationVoltageIndependentlyOfTheInputs) {
  start(Ip330Type::differential);
  chip_.stop();
  EXPECT_EQ(chip_.tryMeasure(ip330::kSource4V9000, 0, 1h), 64881);  // 9.9 V of 10 V, rounded
  EXPECT_EQ(chip_.tryMeasure(ip330::kSourceAutoZero, 3, 1h), 32768);
  EXPECT_EQ(conversions_, 0);
}

// EPICS ip330 R1-0 gave a wrong reading after each calibration.
TEST_F(Ip330ChipTest, DiscardsCodesFromBeforeTheConverterHasSettled) {
  start(Ip330Type::singleEnded);
  chip_.stop();
  ASSERT_TRUE(chip_.tryMeasure(ip330::kSource4V9000, 0, 1h));
  chip_.start(settings_, gains_, 1h);
  conversions_ = 0;
  model_.step();
  EXPECT_EQ(take(), Codes{100});
}

TEST_F(Ip330ChipTest, DiscardsAScanThatBeganWithOtherGains) {
  start(Ip330Type::singleEnded);
  model_.beginScanBeforeDisable();
  gains_[7] = 1;
  chip_.start(settings_, gains_, 1h);
  while (model_.isEndingScan()) {
  }
  EXPECT_EQ(take(), Codes{});
}

TEST_F(Ip330ChipTest, StopsWaitingForAConversionThatNeverEnds) {
  start(Ip330Type::singleEnded);
  chip_.stop();
  model_.setStuck(true);
  EXPECT_EQ(chip_.tryMeasure(ip330::kSource4V9000, 0, 1ms), std::nullopt);
}

TEST_F(Ip330ChipTest, DetectsAnAbsentBoardAndAResetBoard) {
  start(Ip330Type::singleEnded);
  carrier_.setFault("IP_a", ModelFault::busError);
  EXPECT_EQ(chip_.presence(), Ip330Chip::Presence::absent);
  carrier_.setFault("IP_a", ModelFault::none);
  EXPECT_EQ(chip_.presence(), Ip330Chip::Presence::asProgrammed);
  model_.powerCycle();
  EXPECT_EQ(chip_.presence(), Ip330Chip::Presence::reset);
}

}  // namespace
}  // namespace mpf::test
