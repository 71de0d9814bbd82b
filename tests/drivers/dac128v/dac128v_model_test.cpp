// SPDX-License-Identifier: MIT
#include "drivers/dac128v/dac128v_model.h"

#include <gmock/gmock.h>
#include <stdexcept>
#include <utility>
#include <vector>

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::Pair;
using Space = DeviceModel::Space;

constexpr Dac128vRanges kModelRanges{Dac128vRange{-10, 10}, Dac128vRange{0, 5}};

// The register of a channel, all 16 bits.
int registerOf(Dac128vModel& model, std::size_t channel) {
  return model.read(Space::io, 2 * channel, DeviceModel::kBoth);
}

TEST(Dac128vModel, HasTheMiddleCodeInEachChannelAtPowerUp) {
  Dac128vModel model(kModelRanges);
  for (std::size_t channel = 0; channel < 8; ++channel)
    EXPECT_EQ(registerOf(model, channel), 0xf800) << "it does not drive the four highest bits";
  EXPECT_EQ(model.volts(3), 0);
  EXPECT_EQ(model.volts(4), 2.5) << "the second group has its own range";
}

TEST(Dac128vModel, KeepsTwelveBitsOfEachByteLane) {
  Dac128vModel model(kModelRanges);
  model.write(Space::io, 6, 0x5a5a, DeviceModel::kBoth);
  EXPECT_EQ(registerOf(model, 3), 0xfa5a);
  model.write(Space::io, 6, 0x00ff, DeviceModel::kLow);
  EXPECT_EQ(registerOf(model, 3), 0xfaff);
  model.write(Space::io, 6, 0x0100, DeviceModel::kHigh);

  EXPECT_EQ(registerOf(model, 3), 0xf1ff);
  EXPECT_EQ(registerOf(model, 2), 0xf800);
  EXPECT_DOUBLE_EQ(model.volts(3), -10 + 0x1ff * 20.0 / 4096);
}

TEST(Dac128vModel, IgnoresWritesOutsideItsRegisters) {
  Dac128vModel model(kModelRanges);
  model.write(Space::io, 16, 0, DeviceModel::kBoth);
  model.write(Space::memory, 0, 0, DeviceModel::kBoth);

  EXPECT_EQ(registerOf(model, 0), 0xf800);
  EXPECT_EQ(model.read(Space::io, 16, DeviceModel::kBoth), 0);
  EXPECT_EQ(model.read(Space::memory, 0, DeviceModel::kBoth), 0);
}

TEST(Dac128vModel, HoldsStuckBitsAtZeroFromTheNextWriteOn) {
  Dac128vModel model(kModelRanges);
  model.setStuck(1, 0x801);
  EXPECT_EQ(registerOf(model, 1), 0xf800);
  model.write(Space::io, 2, 0x0fff, DeviceModel::kBoth);
  EXPECT_EQ(registerOf(model, 1), 0xf7fe);

  EXPECT_THROW(model.setStuck(8, 1), std::out_of_range);
  EXPECT_THROW(model.setStuck(-1, 1), std::out_of_range);
}

TEST(Dac128vModel, ReportsTheVoltagesOfItsOutputs) {
  std::vector<std::pair<int, double>> told;
  Dac128vModel model(kModelRanges,
                     [&](int channel, double volts) { told.emplace_back(channel, volts); });
  EXPECT_EQ(told.size(), 8u);
  EXPECT_EQ(told[7], std::pair(7, 2.5));
  told.clear();

  model.write(DeviceModel::Space::io, 2, 0, DeviceModel::kBoth);
  model.write(DeviceModel::Space::io, 2, 0x0fff, DeviceModel::kHigh);

  EXPECT_THAT(told, ElementsAre(Pair(1, -10.0), Pair(1, 8.75)));
}

}  // namespace
}  // namespace mpf::test
