// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/model_carrier.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdexcept>
#include <vector>

#include "plain_model.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

// A model that records its cycles.
class RecordedModel final : public DeviceModel {
 public:
  explicit RecordedModel(std::vector<std::string>& cycles)
      : DeviceModel({.manufacturer = 0xa3, .model = 0x11}), cycles_(cycles) {}
  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override {
    cycles_.push_back(
        fmt::format("read {} {:x} {:04x}", nameOf(space), offset, static_cast<unsigned>(lanes)));
    return static_cast<std::uint16_t>(0x1200 + offset);
  }
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override {
    cycles_.push_back(fmt::format("write {} {:x} {:04x} {:04x}", nameOf(space), offset, value,
                                  static_cast<unsigned>(lanes)));
  }

 private:
  static const char* nameOf(Space space) { return space == Space::io ? "io" : "memory"; }
  std::vector<std::string>& cycles_;
};

class ModelCarrierTest : public testing::Test {
 protected:
  void plug() { carrier_.plug("IP_b", std::make_unique<PlainModel>()); }
  // The request line 0 of PlainModel.
  void setRequest(bool active) { site_.io().write16(0, active ? 1 : 0); }

  ModelCarrier carrier_;
  IndustryPackSite& site_ = carrier_.site(1);
  Interrupt& line_ = site_.interrupt(0);
};

TEST_F(ModelCarrierTest, HasSitesOfTheGivenNumberAndMemory) {
  EXPECT_EQ(carrier_.siteCount(), 4U);
  EXPECT_EQ(site_.io().size(), 128U);
  EXPECT_EQ(site_.id().size(), 128U);
  EXPECT_EQ(site_.memory().size(), 65536U);
  EXPECT_THROW(static_cast<void>(carrier_.site(4)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(site_.interrupt(2)), std::out_of_range);

  ModelCarrier small(1, 0);
  EXPECT_EQ(small.siteCount(), 1U);
  EXPECT_EQ(small.site(0).memory().size(), 0U);
}

TEST_F(ModelCarrierTest, ReadsOnesAndIgnoresWritesAtAnEmptySite) {
  site_.io().write32(0, 0);
  site_.memory().write8(0, 0);

  EXPECT_EQ(site_.io().read32(0), 0xffffffffU);
  EXPECT_EQ(site_.memory().read16(0), 0xffff);
  EXPECT_EQ(site_.id().read8(1), 0xff);
}

TEST_F(ModelCarrierTest, DividesAccessesIntoCyclesOfSixteenBits) {
  std::vector<std::string> cycles;
  carrier_.plug("IP_b", std::make_unique<RecordedModel>(cycles));

  EXPECT_EQ(site_.io().read8(0x10), 0x12);
  EXPECT_EQ(site_.io().read8(0x11), 0x10);
  EXPECT_EQ(site_.memory().read16(0x20), 0x1220);
  EXPECT_EQ(site_.io().read32(0x40), 0x12401242U);
  EXPECT_THAT(cycles, ElementsAre("read io 10 ff00", "read io 10 00ff", "read memory 20 ffff",
                                  "read io 40 ffff", "read io 42 ffff"));
  cycles.clear();

  site_.io().write8(0x10, 0xab);
  site_.io().write8(0x11, 0xcd);
  site_.io().write16(0x12, 0x1234);
  site_.memory().write32(0x20, 0x12345678);

  EXPECT_THAT(cycles,
              ElementsAre("write io 10 ab00 ff00", "write io 10 00cd 00ff", "write io 12 1234 ffff",
                          "write memory 20 1234 ffff", "write memory 22 5678 ffff"));
}

TEST_F(ModelCarrierTest, AnswersCyclesOfTheIdSpaceFromTheIdProm) {
  plug();
  EXPECT_EQ(site_.id().read16(0), 0xff00 | 'I') << "an 8-bit PROM drives the low byte only";
  EXPECT_EQ(site_.id().read8(3), 'P');
  EXPECT_EQ(site_.id().read16(126), 0xff00) << "after the PROM";
  site_.id().write16(0, 0);
  EXPECT_EQ(site_.id().read8(1), 'I');

  carrier_.plug("IP_c", std::make_unique<PlainModel>(IdProm{.format = IdProm::Format::two}));

  EXPECT_EQ(carrier_.site(2).id().read32(0), 0x56495441U) << "VITA";
}

TEST_F(ModelCarrierTest, ReturnsThePluggedModelWhichExistsAfterUnplug) {
  auto& model = carrier_.plug("IP_b", std::make_unique<PlainModel>());
  site_.io().write16(2, 0x1234);

  carrier_.unplug("IP_b");

  EXPECT_EQ(site_.io().read16(2), 0xffff);
  site_.io().write16(2, 0);
  EXPECT_EQ(model.read(DeviceModel::Space::io, 2, DeviceModel::kBoth), 0x1234);
  carrier_.unplug("IP_b");
  plug();
  EXPECT_EQ(site_.io().read16(2), 0);
}

TEST_F(ModelCarrierTest, RefusesASecondModelAndAnUnknownSite) {
  plug();
  EXPECT_THAT([&] { plug(); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("site IP_b already has a model")));
  EXPECT_THAT([&] { carrier_.unplug("IP_e"); },
              ThrowsMessage<std::invalid_argument>("no site \"IP_e\"; the sites are IP_a to IP_d"));
  EXPECT_THROW(carrier_.setFault("b", ModelFault::busError), std::invalid_argument);
  EXPECT_THROW(carrier_.setFault("IP_b", ModelFault::busError, 2), std::out_of_range);
}

TEST_F(ModelCarrierTest, PassesOneInterruptForEachEnableWhileTheLineIsActive) {
  plug();
  setRequest(true);
  EXPECT_EQ(line_.take(), 0U) << "the line is masked";

  line_.enable();
  EXPECT_EQ(line_.take(), 1U);
  setRequest(false);
  setRequest(true);
  EXPECT_EQ(line_.take(), 0U) << "the line is masked again";
  line_.enable();
  EXPECT_EQ(line_.take(), 1U);

  setRequest(false);
  line_.enable();
  EXPECT_EQ(line_.take(), 0U);
  setRequest(true);
  EXPECT_EQ(line_.take(), 1U);
  EXPECT_EQ(site_.interrupt(1).take(), 0U);
}

TEST_F(ModelCarrierTest, PassesNoInterruptAfterDisable) {
  plug();
  line_.enable();
  line_.disable();

  setRequest(true);

  EXPECT_EQ(line_.take(), 0U);
}

TEST_F(ModelCarrierTest, HasInactiveLinesAfterUnplug) {
  plug();
  setRequest(true);

  carrier_.unplug("IP_b");

  line_.enable();
  EXPECT_EQ(line_.take(), 0U);
}

TEST_F(ModelCarrierTest, RepeatsTheInterruptInAStorm) {
  carrier_.setFault("IP_b", ModelFault::interruptStorm);
  for (int i = 0; i < 3; ++i) {
    line_.enable();
    EXPECT_EQ(line_.take(), 1U) << "without a request of a model";
  }

  carrier_.setFault("IP_b", ModelFault::none);

  line_.enable();
  EXPECT_EQ(line_.take(), 0U);
}

TEST_F(ModelCarrierTest, LosesInterruptsUntilTheFaultEnds) {
  plug();
  carrier_.setFault("IP_b", ModelFault::interruptsLost);
  setRequest(true);
  line_.enable();
  EXPECT_EQ(line_.take(), 0U);
  EXPECT_EQ(site_.io().read16(0), 1) << "the registers work";

  carrier_.setFault("IP_b", ModelFault::none);

  EXPECT_EQ(line_.take(), 1U) << "the line is still active";
}

TEST_F(ModelCarrierTest, ReadsOnesAfterABusErrorAsWithoutAModule) {
  plug();
  site_.io().write16(2, 0x1234);
  carrier_.setFault("IP_b", ModelFault::busError);
  line_.enable();

  EXPECT_EQ(site_.io().read16(2), 0xffff);
  EXPECT_EQ(site_.id().read16(0), 0xffff);
  site_.io().write16(2, 0);
  EXPECT_EQ(line_.take(), 0U);

  carrier_.setFault("IP_b", ModelFault::none);
  EXPECT_EQ(site_.io().read16(2), 0x1234);
}

TEST_F(ModelCarrierTest, MayHaveAFaultOfOneLineOnly) {
  plug();
  carrier_.setFault("IP_b", ModelFault::interruptStorm, 1);
  carrier_.setFault("IP_b", ModelFault::busError, 0);
  setRequest(true);
  line_.enable();
  site_.interrupt(1).enable();

  EXPECT_EQ(line_.take(), 0U);
  EXPECT_EQ(site_.interrupt(1).take(), 1U);
  EXPECT_EQ(site_.io().read16(0), 1);
}

}  // namespace
}  // namespace mpf::test
