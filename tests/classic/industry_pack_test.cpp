// SPDX-License-Identifier: MIT
#include <mpf/classic/industry_pack.h>

#include <gtest/gtest.h>

#include <mpf/drivers/dac128v.h>
#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/dac128v/dac128v_model.h"

namespace mpf::test {
namespace {

// Carriers and modules exist until the process ends, so each test has new names.
class ClassicIndustryPack : public testing::Test {
 protected:
  ClassicIndustryPack() {
    auto carrier = std::make_unique<ModelCarrier>();
    carrier->plug("IP_b", std::make_unique<Dac128vModel>());
    classic::addCarrier(carrier_.c_str(), std::move(carrier));
  }
  ::IndustryPackModule* create(const std::string& carrier, const char* site) {
    return ::IndustryPackModule::createIndustryPackModule(module_.c_str(), carrier.c_str(), site);
  }
  static inline int tests = 0;
  const std::string carrier_ = "ipac" + std::to_string(++tests);
  const std::string module_ = "dac" + std::to_string(tests);
};

TEST_F(ClassicIndustryPack, FindsAModuleAndTellsWhatItIs) {
  auto* const module = create(carrier_, "IP_b");

  ASSERT_NE(module, nullptr);
  EXPECT_EQ(module->getManufacturer(), kSystran);
  EXPECT_EQ(module->getModel(), Dac128v::kind().models.front());
  EXPECT_EQ(::IndustryPackModule::find(module_.c_str()), module);
  EXPECT_EQ(::IndustryPackModule::find(carrier_.c_str(), "IP_b"), module);
  EXPECT_EQ(::IndustryPackModule::find(carrier_.c_str(), "IP_a"), nullptr);
}

TEST_F(ClassicIndustryPack, ADriverOpensTheModule) {
  auto* const module = create(carrier_, "IP_b");
  ASSERT_NE(module, nullptr);

  Dac128v dac(module->open(Dac128v::kind()));

  EXPECT_EQ(dac.tryWrite(0, 5), Dac128vStatus::success);
}

TEST_F(ClassicIndustryPack, AnEmptySiteAnUnknownCarrierAndAUsedNameArePrinted) {
  testing::internal::CaptureStderr();

  EXPECT_EQ(create(carrier_, "IP_a"), nullptr);
  EXPECT_EQ(create("no such carrier", "IP_a"), nullptr);
  EXPECT_NE(create(carrier_, "IP_b"), nullptr);
  EXPECT_EQ(create(carrier_, "IP_b"), nullptr);

  const auto printed = testing::internal::GetCapturedStderr();
  EXPECT_NE(printed.find("IndustryPackModule " + module_ + ": "), std::string::npos);
  EXPECT_NE(printed.find("no such carrier"), std::string::npos);
  EXPECT_NE(printed.find("the name is in use"), std::string::npos);
}

}  // namespace
}  // namespace mpf::test
