// SPDX-License-Identifier: MIT
#include "drivers/ip440/ip440.h"

#include <array>
#include <gmock/gmock.h>
#include <stdexcept>

#include "drivers/ip440/ip440_model.h"
#include "tests/drivers/industry_pack/plain_model.h"
#include "tests/support/model_carrier.h"

namespace mpf::test {
namespace {

class Ip440Test : public testing::Test {
 protected:
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  Ip440Model& model_ = carrier_.plug("IP_c", std::make_unique<Ip440Model>(0x1));
  IndustryPackModules modules_{carriers_};
  Ip440 inputs_{modules_.create("in", "ipac", "IP_c", Ip440::kind())};
};

TEST_F(Ip440Test, ReadsEachInputAsItsBit) {
  EXPECT_EQ(inputs_.tryRead(), 0x1u);
  for (int input = 0; input < Ip440::kInputs; ++input) {
    model_.setInputs(std::uint32_t{1} << input);
    EXPECT_EQ(inputs_.tryRead(), std::uint32_t{1} << input);
  }
}

TEST_F(Ip440Test, DistinguishesAllInputsOnFromAnAbsentModule) {
  model_.setInputs(0xffffffff);
  EXPECT_EQ(inputs_.tryRead(), 0xffffffffu);

  carrier_.setFault("IP_c", ModelFault::busError);
  EXPECT_EQ(inputs_.tryRead(), std::nullopt);

  carrier_.setFault("IP_c", ModelFault::none);
  EXPECT_EQ(inputs_.tryRead(), 0xffffffffu);
}

TEST_F(Ip440Test, ReadsNothingFromAnotherModule) {
  carrier_.unplug("IP_c");
  EXPECT_EQ(inputs_.tryRead(), std::nullopt);
  carrier_.plug("IP_c", std::make_unique<PlainModel>());
  EXPECT_EQ(inputs_.tryRead(), std::nullopt);

  carrier_.unplug("IP_c");
  carrier_.plug("IP_c", std::make_unique<Ip440Model>(0x5));
  EXPECT_EQ(inputs_.tryRead(), 0x5u);
}

TEST_F(Ip440Test, ReadsConnectedVoltages) {
  double volts = 0;
  model_.connect(31, [&] { return volts; });
  EXPECT_EQ(inputs_.tryRead(), 0x1u);
  volts = 5;
  EXPECT_EQ(inputs_.tryRead(), 0x80000001u);
  EXPECT_THROW(model_.connect(32, {}), std::out_of_range);
}

TEST_F(Ip440Test, KeepsItsInputsWhenItsPortsAreWrittenTo) {
  for (std::size_t offset = 0; offset < 16; offset += 2)
    carrier_.site(2).io().write16(offset, 0xffff);
  EXPECT_EQ(inputs_.tryRead(), 0x1u);
}

TEST_F(Ip440Test, HasTheIdPromOfTheManual) {  // table 3.2, with its CRC
  auto& id = carrier_.site(2).id();
  const std::array<std::uint8_t, 12> manual{'I', 'P', 'A', 'C', 0xa3, 0x10, 0, 0, 0, 0, 12, 0x3b};
  for (std::size_t at = 0; at < manual.size(); ++at)
    EXPECT_EQ(id.read8(2 * at + 1), manual.at(at)) << at;
}

}  // namespace
}  // namespace mpf::test
