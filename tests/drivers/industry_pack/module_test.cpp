// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/module.h>

#include <gmock/gmock.h>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "plain_model.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class ModuleTest : public testing::Test {
 protected:
  ModuleTest() {
    auto carrier = std::make_unique<ModelCarrier>();
    model_ = carrier.get();
    carriers_.add("ipac", std::move(carrier));
  }
  void expectError(IndustryPackStatus status, const std::string& words) {
    try {
      modules_.create("adc", "ipac", "IP_a", kind_);
      FAIL() << "no error";
    } catch (const IndustryPackError& error) {
      EXPECT_EQ(error.status(), status) << toString(error.status());
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
  IndustryPackCarriers carriers_;
  ModelCarrier* model_ = nullptr;
  IndustryPackModules modules_{carriers_};
  ModuleKind kind_{.name = "Acromag IP330", .manufacturer = kAcromag, .models = {0x11}};
};

TEST_F(ModuleTest, IsFoundByNameAndByPlace) {
  model_->plug("IP_a", std::make_unique<PlainModel>());
  auto& module = modules_.create("adc", "ipac", "IP_a", kind_);
  EXPECT_EQ(modules_.find("adc"), &module);
  EXPECT_EQ(modules_.find("ipac", "IP_a"), &module);
  EXPECT_EQ(modules_.find("dac"), nullptr);
  EXPECT_EQ(module.idProm().model, 0x11);
  EXPECT_EQ(module.problem(), "");
}

TEST_F(ModuleTest, ThatIsAbsentIsRefused) {
  expectError(IndustryPackStatus::noModule, "no module at carrier ipac, site IP_a");
}

TEST_F(ModuleTest, OfAnotherManufacturerIsRefused) {
  model_->plug("IP_a", std::make_unique<PlainModel>(IdProm{.manufacturer = 0x45, .model = 0x11}));
  expectError(IndustryPackStatus::badModule,
              "is not the expected Acromag IP330: its manufacturer is 0x45, not 0xa3");
}

TEST_F(ModuleTest, OfAnotherModelIsRefused) {
  model_->plug("IP_a", std::make_unique<PlainModel>(IdProm{.manufacturer = 0xa3, .model = 0x12}));
  expectError(IndustryPackStatus::badModule, "its model is 0x12");
}

TEST_F(ModuleTest, MayBeOfAnyManufacturerOfItsKind) {
  kind_.others.push_back({.manufacturer = kSystran, .models = {0x63}});
  model_->plug("IP_a",
               std::make_unique<PlainModel>(IdProm{.manufacturer = kSystran, .model = 0x63}));
  EXPECT_EQ(modules_.create("dio", "ipac", "IP_a", kind_).idProm().manufacturer, kSystran);
}

TEST_F(ModuleTest, OfAnotherModelOfAKnownManufacturerIsRefused) {
  kind_.others.push_back({.manufacturer = kSystran, .models = {0x63}});
  model_->plug("IP_a",
               std::make_unique<PlainModel>(IdProm{.manufacturer = kSystran, .model = 0x11}));
  expectError(IndustryPackStatus::badModule, "its model is 0x11, not 0x63");
}

TEST_F(ModuleTest, WithAWrongCrcIsRefused) {
  model_->plug("IP_a", std::make_unique<PlainModel>(
                           IdProm{.manufacturer = 0xa3, .model = 0x11, .hasValidCrc = false}));
  expectError(IndustryPackStatus::badCrc, "CRC");
}

TEST_F(ModuleTest, CannotBeCreatedTwice) {
  model_->plug("IP_a", std::make_unique<PlainModel>());
  modules_.create("adc", "ipac", "IP_a", kind_);
  EXPECT_THROW(modules_.create("adc", "ipac", "IP_b", kind_), std::invalid_argument);
  EXPECT_THROW(modules_.create("adc2", "ipac", "IP_a", kind_), std::invalid_argument);
}

TEST_F(ModuleTest, NeedsAnExistingCarrierAndSite) {
  EXPECT_THROW(modules_.create("adc", "ipac1", "IP_a", kind_), std::invalid_argument);
  EXPECT_THROW(modules_.create("adc", "ipac", "IP_e", kind_), std::invalid_argument);
  EXPECT_THROW(modules_.create("adc", "ipac", "a", kind_), std::invalid_argument);
}

TEST_F(ModuleTest, ThatIsPulledOutHasAProblem) {
  model_->plug("IP_a", std::make_unique<PlainModel>());
  auto& module = modules_.create("adc", "ipac", "IP_a", kind_);
  model_->unplug("IP_a");
  EXPECT_THAT(module.problem(), HasSubstr("no module"));
  EXPECT_EQ(module.io().read16(0), 0xffff);
}

TEST_F(ModuleTest, ThatIsReplacedByAnotherModelOfItsKindHasAProblem) {
  kind_.models.push_back(0x12);
  model_->plug("IP_a", std::make_unique<PlainModel>());
  auto& module = modules_.create("adc", "ipac", "IP_a", kind_);
  model_->unplug("IP_a");
  model_->plug("IP_a", std::make_unique<PlainModel>(IdProm{.manufacturer = 0xa3, .model = 0x12}));
  EXPECT_THAT(
      module.problem(),
      HasSubstr(
          "carrier ipac, site IP_a has another Acromag IP330: 0xa3/0x12 in place of 0xa3/0x11"));
  model_->unplug("IP_a");
  model_->plug("IP_a", std::make_unique<PlainModel>(
                           IdProm{.manufacturer = 0xa3, .model = 0x11, .revision = 7}));
  EXPECT_EQ(module.problem(), "");
}

TEST_F(ModuleTest, SharesItsVectorWithNoOtherModule) {
  model_->plug("IP_a", std::make_unique<PlainModel>());
  model_->plug("IP_b", std::make_unique<PlainModel>());
  auto& a = modules_.create("a", "ipac", "IP_a", kind_);
  auto& b = modules_.create("b", "ipac", "IP_b", kind_);
  modules_.takeVector(120, a);
  modules_.takeVector(120, a);
  EXPECT_THROW(modules_.takeVector(120, b), IndustryPackError);
  EXPECT_THROW(modules_.takeVector(256, b), IndustryPackError);
}

}  // namespace
}  // namespace mpf::test
