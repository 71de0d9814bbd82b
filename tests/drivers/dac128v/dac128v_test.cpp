// SPDX-License-Identifier: MIT
#include <mpf/drivers/dac128v.h>

#include <atomic>
#include <barrier>
#include <gtest/gtest.h>
#include <thread>

#include "drivers/dac128v/dac128v_model.h"
#include "tests/drivers/industry_pack/plain_model.h"
#include "tests/support/model_carrier.h"

namespace mpf::test {
namespace {

constexpr Dac128vRanges kRanges{Dac128vRange{-10, 10}, Dac128vRange{0, 5}};

class Dac128vTest : public testing::Test {
 protected:
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  Dac128vModel& model_ = plug();
  IndustryPackModules modules_{carriers_};
  IndustryPackModule& module_ = modules_.create("dac", "ipac", "IP_a", Dac128v::kind());
  Dac128v dac_{module_};

  Dac128vModel& plug() { return carrier_.plug("IP_a", std::make_unique<Dac128vModel>(kRanges)); }
  // The contents of the register, read without the driver.
  int code(int channel) {
    return carrier_.site(0).io().read16(2 * static_cast<std::size_t>(channel)) & 0xfff;
  }
};

TEST_F(Dac128vTest, KeepsTheMiddleCodeOfThePowerUp) {
  for (int channel = 0; channel < Dac128v::kChannels; ++channel) {
    EXPECT_EQ(dac_.tryRead(channel), 2048);
    EXPECT_EQ(model_.volts(channel), channel < 4 ? 0.0 : 2.5);
  }
}

TEST_F(Dac128vTest, GivesEachChannelItsOwnCode) {
  for (int channel = 0; channel < Dac128v::kChannels; ++channel)
    EXPECT_EQ(dac_.tryWrite(channel, 100 * channel), Dac128vStatus::success);

  for (int channel = 0; channel < Dac128v::kChannels; ++channel)
    EXPECT_EQ(dac_.tryRead(channel), 100 * channel);
}

TEST_F(Dac128vTest, AcceptsBothEndsOfItsRange) {
  EXPECT_EQ(dac_.tryWrite(0, 0), Dac128vStatus::success);
  EXPECT_EQ(model_.volts(0), -10);
  EXPECT_EQ(dac_.tryWrite(0, 4095), Dac128vStatus::success);
  EXPECT_DOUBLE_EQ(model_.volts(0), 10 - 20.0 / 4096);
}

TEST_F(Dac128vTest, RefusesInvalidCodesAndChannelsAndWritesNothing) {
  ASSERT_EQ(dac_.tryWrite(7, 1234), Dac128vStatus::success);

  for (const int code : {-1, 4096, 0x10000, INT32_MIN, INT32_MAX})
    EXPECT_EQ(dac_.tryWrite(7, code), Dac128vStatus::outOfRange) << code;
  for (const int channel : {-1, 8, INT32_MIN, INT32_MAX}) {
    EXPECT_EQ(dac_.tryWrite(channel, 0), Dac128vStatus::noChannel) << channel;
    EXPECT_EQ(dac_.tryRead(channel), std::nullopt) << channel;
  }

  EXPECT_EQ(dac_.tryRead(7), 1234);
  EXPECT_EQ(dac_.tryRead(0), Dac128v::kPowerUpCode);
}

TEST_F(Dac128vTest, RestoresAllChannelsAfterAResetOfTheModule) {
  for (const int channel : {1, 5, 6})
    ASSERT_EQ(dac_.tryWrite(channel, 100 * channel), Dac128vStatus::success);
  carrier_.unplug("IP_a");
  plug();

  EXPECT_EQ(dac_.tryWrite(2, 7), Dac128vStatus::success);

  for (const int channel : {1, 5, 6}) EXPECT_EQ(code(channel), 100 * channel);
  EXPECT_EQ(code(2), 7);
  for (const int channel : {0, 3, 4, 7}) EXPECT_EQ(code(channel), Dac128v::kPowerUpCode);
  EXPECT_EQ(dac_.restorations(), 1u);
  EXPECT_EQ(dac_.tryWrite(2, 8), Dac128vStatus::success);
  EXPECT_EQ(dac_.restorations(), 1u);
}

TEST_F(Dac128vTest, CountsABrokenRegisterOnceAndWritesTheOtherChannels) {
  ASSERT_EQ(dac_.tryWrite(1, 1), Dac128vStatus::success);
  model_.setStuck(1, 1);
  model_.write(DeviceModel::Space::io, 2, 0, DeviceModel::kBoth);

  for (int i = 0; i < 3; ++i) EXPECT_EQ(dac_.tryWrite(2, 100), Dac128vStatus::success);

  EXPECT_EQ(dac_.restorations(), 1u);
}

TEST_F(Dac128vTest, WritesNothingToAnotherModule) {
  ASSERT_EQ(dac_.tryWrite(1, 100), Dac128vStatus::success);
  carrier_.unplug("IP_a");
  auto& other = carrier_.plug("IP_a", std::make_unique<PlainModel>());

  EXPECT_EQ(dac_.tryWrite(2, 7), Dac128vStatus::gone);

  for (std::size_t offset = 0; offset < 16; offset += 2)
    EXPECT_EQ(other.read(DeviceModel::Space::io, offset, DeviceModel::kBoth), 0);
}

// This also holds for the first write, when the contents of the registers are unknown.
TEST_F(Dac128vTest, WritesNothingToAModuleThatWasReplacedBeforeTheFirstWrite) {
  carrier_.unplug("IP_a");
  auto& other = carrier_.plug("IP_a", std::make_unique<PlainModel>());
  EXPECT_EQ(dac_.tryWrite(2, 7), Dac128vStatus::gone);
  EXPECT_EQ(other.read(DeviceModel::Space::io, 4, DeviceModel::kBoth), 0);
}

TEST_F(Dac128vTest, ReportsARegisterThatHoldsAnotherCode) {
  model_.setStuck(2, 0x800);

  EXPECT_EQ(dac_.tryWrite(2, 0x801), Dac128vStatus::readBackDiffers);
  EXPECT_EQ(dac_.tryWrite(2, 0x7ff), Dac128vStatus::success);
}

TEST_F(Dac128vTest, ReportsAnAbsentModule) {
  carrier_.setFault("IP_a", ModelFault::busError);
  EXPECT_EQ(dac_.tryWrite(0, 4095), Dac128vStatus::gone);
  EXPECT_EQ(dac_.tryRead(0), std::nullopt);

  carrier_.setFault("IP_a", ModelFault::none);
  EXPECT_EQ(dac_.tryWrite(0, 4095), Dac128vStatus::success);

  carrier_.unplug("IP_a");
  EXPECT_EQ(dac_.tryWrite(0, 4095), Dac128vStatus::gone);
}

TEST_F(Dac128vTest, ReadsBackItsOwnWriteWhenTwoThreadsWriteAtOnce) {
  std::atomic<int> failures{0};
  std::barrier start(2);
  const auto write = [&](int code) {
    start.arrive_and_wait();
    for (int i = 0; i < 100'000; ++i)
      failures += dac_.tryWrite(0, code) != Dac128vStatus::success ? 1 : 0;
  };
  {
    const std::jthread other([&] { write(1); });
    write(2);
  }
  EXPECT_EQ(failures, 0);
}

}  // namespace
}  // namespace mpf::test
