// SPDX-License-Identifier: MIT
#include <mpf/classic/industry_pack.h>

#include <gtest/gtest.h>

#include <mpf/drivers/dac128v.h>
#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/dac128v/dac128v_model.h"

namespace mpf::test {
namespace {

// Carriers and modules exist until the process ends: ctest runs each test in a process of its own,
// but a developer may not, so each test has a carrier with another name.
void addCarrierWithDac(const char* name) {
  auto carrier = std::make_unique<ModelCarrier>();
  carrier->plug("IP_b", std::make_unique<Dac128vModel>());
  classic::addCarrier(name, std::move(carrier));
}

::IndustryPackModule* create(const char* module, const char* carrier, const char* site) {
  return ::IndustryPackModule::createIndustryPackModule(module, carrier, site);
}

TEST(ClassicIndustryPack, FindsAModuleAndTellsWhatItIs) {
  addCarrierWithDac("found");

  auto* const module = create("dac", "found", "IP_b");

  ASSERT_NE(module, nullptr);
  EXPECT_EQ(module->getManufacturer(), kSystran);
  EXPECT_EQ(module->getModel(), Dac128v::kind().models.front());
  EXPECT_EQ(::IndustryPackModule::find("dac"), module);
  EXPECT_EQ(::IndustryPackModule::find("found", "IP_b"), module);
  EXPECT_EQ(::IndustryPackModule::find("found", "IP_a"), nullptr);
}

TEST(ClassicIndustryPack, ADriverOpensTheModule) {
  addCarrierWithDac("opened");
  auto* const module = create("driven", "opened", "IP_b");
  ASSERT_NE(module, nullptr);

  Dac128v dac(module->open(Dac128v::kind()));

  EXPECT_EQ(dac.tryWrite(0, 5), Dac128vStatus::success);
}

TEST(ClassicIndustryPack, AnEmptySiteAnUnknownCarrierAndAUsedNameArePrinted) {
  addCarrierWithDac("used");
  EXPECT_NE(create("used name", "used", "IP_b"), nullptr);
  testing::internal::CaptureStderr();

  EXPECT_EQ(create("empty", "used", "IP_a"), nullptr);
  EXPECT_EQ(create("lost", "no such carrier", "IP_a"), nullptr);
  EXPECT_EQ(create("used name", "used", "IP_b"), nullptr);

  const auto printed = testing::internal::GetCapturedStderr();
  EXPECT_NE(printed.find("IndustryPackModule empty: "), std::string::npos);
  EXPECT_NE(printed.find("no such carrier"), std::string::npos);
  EXPECT_NE(printed.find("the name is in use"), std::string::npos);
}

}  // namespace
}  // namespace mpf::test
