// SPDX-License-Identifier: MIT
// The device model, register by register, not in real time: the test runs each scan.
#include "drivers/ip330/ip330_model.h"

#include <gmock/gmock.h>
#include <stdexcept>

#include "drivers/ip330/ip330_registers.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

class Ip330ModelTest : public testing::Test {
 protected:
  static constexpr std::uint16_t kSingleEnded =
      ip330::kSourceSingleEnded | ip330::kStraightBinary | ip330::kTimerEnable;

  static unsigned read(Ip330Model& model, std::size_t offset) {
    return model.read(DeviceModel::Space::io, offset, DeviceModel::kBoth);
  }
  static void write(Ip330Model& model, std::size_t offset, unsigned value) {
    model.write(DeviceModel::Space::io, offset, static_cast<std::uint16_t>(value),
                DeviceModel::kBoth);
  }
  static void setMode(Ip330Model& model, unsigned control, Ip330ScanMode mode) {
    write(model, ip330::kControl, control | static_cast<unsigned>(mode) << ip330::kScanModeShift);
  }
  // Scans channels 2 to 5 and discards the codes from before the converter has settled.
  static void start(Ip330Model& model, unsigned control = kSingleEnded,
                    Ip330ScanMode mode = Ip330ScanMode::burstContinuous) {
    write(model, ip330::kEndChannel, 5 << 8 | 2);
    setMode(model, control | ip330::kInterruptAfterAll, mode);
    write(model, ip330::kStartConvert, 1);
    model.step();
    for (int channel = 2; channel <= 5; ++channel) static_cast<void>(code(model, channel));
  }
  // Reads a mailbox.
  static unsigned code(Ip330Model& model, int channel) {
    return read(model, ip330::kMailBox + 2 * static_cast<std::size_t>(channel));
  }
  unsigned read(std::size_t offset) { return read(model_, offset); }
  void write(std::size_t offset, unsigned value) { write(model_, offset, value); }
  unsigned code(int channel) { return code(model_, channel); }
  // Whether the request line is active.
  bool requests() const { return isRequesting_; }
  void watchInterrupt() {
    model_.connectInterrupts([this](int number, bool active) {
      EXPECT_EQ(number, 0);
      isRequesting_ = active;
    });
  }

  Ip330Model model_{{.isRealTime = false}};
  bool isRequesting_ = false;
};

TEST_F(Ip330ModelTest, HasTheIdealCodesOfEachRangeAndGain) {
  EXPECT_EQ(Ip330Model::idealCode(Ip330Range::minus5to5, 0, -5), 0);
  EXPECT_EQ(Ip330Model::idealCode(Ip330Range::minus5to5, 0, 5), 65536);
  EXPECT_EQ(Ip330Model::idealCode(Ip330Range::minus10to10, 0, 0), 32768);
  EXPECT_EQ(Ip330Model::idealCode(Ip330Range::from0to10, 0, 2.5), 16384);
  EXPECT_EQ(Ip330Model::idealCode(Ip330Range::from0to5, 3, 0.3125), 32768) << "gain 8";
}

TEST_F(Ip330ModelTest, ConvertsEachChannelOfAScanWithItsGain) {
  start(model_);
  write(ip330::kGainSelect + 4, 0x0301);  // channels 4 and 5
  for (int channel = 0; channel < 8; ++channel)
    model_.setSignal(channel, [](double) { return 0.5; });

  model_.step();

  EXPECT_EQ(code(2), 32768U + 3277);
  EXPECT_EQ(code(4), 32768U + 26214) << "gain 8";
  EXPECT_EQ(code(5), 32768U + 6554) << "gain 2";
  EXPECT_EQ(code(1), 0U);
  EXPECT_EQ(code(6), 0U);
  EXPECT_THROW(model_.setSignal(32, {}), std::out_of_range);
}

TEST_F(Ip330ModelTest, HasTheErrorsOfItsConverter) {
  Ip330Model model(
      {.gainError = {0, 0.01, 0, 0}, .offsetError = {-7, 0, 0, 0}, .isRealTime = false});
  start(model);
  write(model, ip330::kGainSelect + 2, 0x0001);  // channel 3: gain 2

  model.step();

  EXPECT_EQ(code(model, 2), 32768U - 7);
  EXPECT_EQ(code(model, 3), 33096U) << "1 % too high";
}

TEST_F(Ip330ModelTest, LimitsItsCodesToTheRange) {
  start(model_);
  model_.setSignal(2, [](double) { return 100.0; });
  model_.setSignal(3, [](double) { return -100.0; });

  model_.step();

  EXPECT_EQ(code(2), 0xffffU);
  EXPECT_EQ(code(3), 0U);
}

TEST_F(Ip330ModelTest, GivesTwosComplementUnlessStraightBinaryIsSet) {
  start(model_, kSingleEnded & ~ip330::kStraightBinary);
  model_.setSignal(2, [](double) { return -5.0; });

  model_.step();

  EXPECT_EQ(code(2), 0x8000U);
  EXPECT_EQ(code(3), 0U);
}

TEST_F(Ip330ModelTest, FlagsNewAndOverwrittenMailboxesUntilTheyAreRead) {
  start(model_);
  EXPECT_EQ(read(ip330::kNewData), 0U);

  model_.step();
  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
  EXPECT_EQ(read(ip330::kMissedData), 0U);
  static_cast<void>(code(3));
  EXPECT_EQ(read(ip330::kNewData), 0x34U);
  model_.step();
  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
  EXPECT_EQ(read(ip330::kMissedData), 0x34U);

  for (int channel = 2; channel <= 5; ++channel) static_cast<void>(code(channel));
  EXPECT_EQ(read(ip330::kNewData), 0U);
  EXPECT_EQ(read(ip330::kMissedData), 0U);
}

TEST_F(Ip330ModelTest, PutsDifferentialScansIntoBothHalvesInTurn) {
  start(model_, ip330::kSourceDifferential | ip330::kStraightBinary | ip330::kTimerEnable);
  static_cast<void>(read(ip330::kMailBox + 2 * 18));

  model_.step();
  EXPECT_EQ(read(ip330::kNewData), 0U);
  EXPECT_EQ(read(ip330::kNewData + 2), 0x3cU) << "the first scan was in the lower half";
  model_.step();
  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
}

TEST_F(Ip330ModelTest, HasWrongCodesInTheFirstScanAfterAChangeOfTheSource) {
  start(model_);
  setMode(model_, ip330::kSourceAutoZero | ip330::kStraightBinary, Ip330ScanMode::burstSingle);

  write(ip330::kStartConvert, 1);
  EXPECT_EQ(code(2), 32768U + 300);
  write(ip330::kStartConvert, 1);
  EXPECT_EQ(code(2), 32768U);
}

TEST_F(Ip330ModelTest, MeasuresItsCalibrationVoltages) {
  write(ip330::kEndChannel, 0);
  for (const auto& [source, wanted] : {std::pair{ip330::kSource4V9000, 64881U},
                                       {ip330::kSource2V4500, 48824U},
                                       {ip330::kSource1V2250, 40796U},
                                       {ip330::kSource0V6125, 36782U}}) {
    setMode(model_, source | ip330::kStraightBinary, Ip330ScanMode::burstSingle);
    for (int i = 0; i < 2; ++i) write(ip330::kStartConvert, 1);  // the first one settles
    EXPECT_EQ(code(0), wanted);
  }
}

TEST_F(Ip330ModelTest, RequestsAnInterruptUntilTheLastMailboxIsRead) {
  start(model_);
  watchInterrupt();
  model_.step();
  EXPECT_TRUE(requests());
  static_cast<void>(code(4));
  EXPECT_TRUE(requests());
  static_cast<void>(code(5));
  EXPECT_FALSE(requests());

  model_.step();
  EXPECT_TRUE(requests());
  setMode(model_, kSingleEnded, Ip330ScanMode::burstContinuous);  // interrupts disabled
  EXPECT_FALSE(requests());
  model_.step();
  EXPECT_FALSE(requests());
}

TEST_F(Ip330ModelTest, ScansAtAnExternalTriggerUnlessTheTriggerIsAnOutput) {
  start(model_, kSingleEnded, Ip330ScanMode::uniformSingle);
  model_.step();
  EXPECT_EQ(read(ip330::kNewData), 0U) << "a single mode does not scan by itself";
  model_.externalTrigger();
  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
  for (int channel = 2; channel <= 5; ++channel) static_cast<void>(code(channel));

  setMode(model_, kSingleEnded | ip330::kTriggerOutput, Ip330ScanMode::uniformSingle);
  model_.externalTrigger();

  EXPECT_EQ(read(ip330::kNewData), 0U);
}

TEST_F(Ip330ModelTest, ConvertsOneChannelForEachTriggerInItsLastMode) {
  start(model_, kSingleEnded, Ip330ScanMode::convertOnExternalTriggerOnly);
  std::vector<unsigned> flags;
  for (int i = 0; i < 5; ++i) {
    model_.externalTrigger();
    flags.push_back(read(ip330::kNewData));
  }
  EXPECT_THAT(flags, ElementsAre(0x04, 0x0c, 0x1c, 0x3c, 0x3c));
  EXPECT_EQ(read(ip330::kMissedData), 0x04U) << "channel 2 again";
}

TEST_F(Ip330ModelTest, EndsNoConversionWhileItIsStuck) {
  start(model_);
  model_.setStuck(true);
  model_.step(3);
  EXPECT_EQ(read(ip330::kNewData), 0U);

  model_.setStuck(false);
  model_.step();

  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
}

TEST_F(Ip330ModelTest, KeepsSettingsAndIgnoresWritesToResults) {
  start(model_);
  model_.step();
  write(ip330::kConversionTimer, 0x1234);
  model_.write(DeviceModel::Space::io, ip330::kTimerPrescaler, 0x40ff, DeviceModel::kHigh);
  for (const auto offset : {ip330::kNewData, ip330::kMissedData, ip330::kMailBox + 4})
    write(offset, 0x5555);

  EXPECT_EQ(read(ip330::kConversionTimer), 0x1234U);
  EXPECT_EQ(read(ip330::kTimerPrescaler), 0x4000U);
  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
  EXPECT_EQ(read(ip330::kMissedData), 0U);
  EXPECT_EQ(code(2), 32768U);
  EXPECT_EQ(model_.read(DeviceModel::Space::memory, 0, DeviceModel::kBoth), 0xffff);
}

TEST_F(Ip330ModelTest, LosesSettingsAndScansAtAPowerCycle) {
  start(model_);
  watchInterrupt();
  model_.step();
  ASSERT_TRUE(requests());

  model_.powerCycle();

  EXPECT_FALSE(requests());
  EXPECT_EQ(read(ip330::kControl), 0U);
  EXPECT_EQ(read(ip330::kEndChannel), 0U);
  model_.step();
  EXPECT_EQ(read(ip330::kNewData), 0U);
}

TEST_F(Ip330ModelTest, EndsAScanThatHadBegunWithItsOldGains) {
  start(model_);
  model_.setSignal(2, [](double) { return 1.0; });
  model_.beginScanBeforeDisable();
  setMode(model_, kSingleEnded, Ip330ScanMode::disable);
  write(ip330::kGainSelect + 2, 0x0300);

  while (model_.isEndingScan()) continue;

  EXPECT_EQ(read(ip330::kNewData), 0x3cU);
  EXPECT_EQ(code(2), 32768U + 6554) << "gain 1";
}

}  // namespace
}  // namespace mpf::test
