// SPDX-License-Identifier: MIT
#include "drivers/ip440/ip440.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace mpf::test
