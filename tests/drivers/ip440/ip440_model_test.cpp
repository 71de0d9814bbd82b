// SPDX-License-Identifier: MIT
#include "drivers/ip440/ip440_model.h"

#include <array>
#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::test {
namespace {

using Space = DeviceModel::Space;

class Ip440ModelTest : public testing::Test {
 protected:
  int read(std::size_t offset, Space space = Space::io) {
    return model_.read(space, offset, DeviceModel::kBoth);
  }
  Ip440Model model_{0x80402011};
};

TEST_F(Ip440ModelTest, HasEightInputsInTheLowByteOfEachPort) {
  EXPECT_EQ(read(0), 0xff11) << "the high byte is not driven";
  EXPECT_EQ(read(2), 0xff20);
  EXPECT_EQ(read(4), 0xff40);
  EXPECT_EQ(read(6), 0xff80);

  model_.setInputs(0x01020304);

  EXPECT_EQ(read(0), 0xff04);
  EXPECT_EQ(read(6), 0xff01);
}

TEST_F(Ip440ModelTest, ReadsZeroesOutsideItsPorts) {
  EXPECT_EQ(read(8), 0xff00);
  EXPECT_EQ(read(0, Space::memory), 0xff00);
}

TEST_F(Ip440ModelTest, KeepsItsInputsWhenItsPortsAreWrittenTo) {
  for (std::size_t offset = 0; offset < 16; offset += 2)
    model_.write(Space::io, offset, 0xffff, DeviceModel::kBoth);

  EXPECT_EQ(read(0), 0xff11);
}

TEST_F(Ip440ModelTest, ComparesConnectedVoltagesWithTheThreshold) {
  double volts = Ip440Model::kOnVolts;
  model_.connect(31, [&] { return volts; });
  model_.connect(1, [&] { return 5.0; });
  EXPECT_EQ(read(6), 0xff00) << "not above the threshold";
  EXPECT_EQ(read(0), 0xff13);
  volts += 0.1;
  EXPECT_EQ(read(6), 0xff80);

  volts = 0;
  model_.setInputs(0xffffffff);
  EXPECT_EQ(read(6), 0xff7f) << "a connected input follows its voltage only";
  model_.connect(31, {});
  EXPECT_EQ(read(6), 0xffff);
  EXPECT_THROW(model_.connect(32, {}), std::out_of_range);
  EXPECT_THROW(model_.connect(-1, {}), std::out_of_range);
}

TEST_F(Ip440ModelTest, HasTheIdPromOfTheManual) {  // table 3.2, with its CRC
  const std::array<std::uint16_t, 12> manual{'I', 'P', 'A', 'C', 0xa3, 0x10, 0, 0, 0, 0, 12, 0x3b};
  const auto words = wordsOf(model_.id());
  ASSERT_EQ(words.size(), manual.size());
  for (std::size_t at = 0; at < manual.size(); ++at) EXPECT_EQ(words[at], manual.at(at)) << at;
}

}  // namespace
}  // namespace mpf::test
