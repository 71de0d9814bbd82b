// SPDX-License-Identifier: MIT
#include "drivers/gpib/bus_model.h"

#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>

#include "tests/drivers/gpib/hand_controller.h"
#include "tests/drivers/gpib/memory_instrument.h"

namespace mpf::test {
namespace {

using Kind = GpibFault::Kind;

// '!' and '"' address the instruments at 1 and 2 to listen, 'A' and 'B' to talk.
class BusModelTest : public testing::Test {
 protected:
  BusModelTest() {
    bus_.attach({1}, first_);
    bus_.attach({2}, second_);
  }
  GpibBusModel bus_;
  std::shared_ptr<MemoryInstrument> first_ = std::make_shared<MemoryInstrument>();
  std::shared_ptr<MemoryInstrument> second_ = std::make_shared<MemoryInstrument>();
  HandController hand_{bus_};
};

TEST_F(BusModelTest, CarriesAByteToAllListeners) {
  hand_.commands("!\"");

  EXPECT_TRUE(hand_.data('x'));

  EXPECT_EQ(first_->text(), "x");
  EXPECT_EQ(second_->text(), "x");
}

TEST_F(BusModelTest, IsAsSlowAsTheSlowestListener) {
  hand_.commands("!\"");
  second_->accepts = false;
  hand_.drive(gpib_line::kRen);

  hand_.drive(gpib_line::kRen | gpib_line::kDav, 'x');

  EXPECT_EQ(first_->text(), "x");
  EXPECT_TRUE(hand_.isActive(gpib_line::kNdac));
}

TEST_F(BusModelTest, CarriesAMessageFromInstrumentToInstrument) {
  first_->send("hello");
  hand_.commands("A\"");

  hand_.drive(0);

  EXPECT_EQ(second_->text(), "hello");
  EXPECT_TRUE(second_->ends.back());
}

// An instrument that never ends.
class Endless final : public GpibInstrumentModel {
 public:
  bool receive(std::uint8_t /*byte*/, bool /*end*/) override { return true; }
  std::optional<Byte> nextByte() override { return Byte{'x', false}; }
};

TEST_F(BusModelTest, ReturnsAlsoWhileATalkerNeverPauses) {
  bus_.attach({3}, std::make_shared<Endless>());
  hand_.commands("C\"");

  hand_.drive(0);
  const auto before = second_->received.size();
  bus_.proceed();

  EXPECT_GT(before, 0U);
  EXPECT_GT(second_->received.size(), before);
}

TEST_F(BusModelTest, RefusesAddressesThatAreInUseOrInvalid) {
  EXPECT_THROW(bus_.attach({1}, second_), std::invalid_argument);
  EXPECT_THROW(bus_.attach({31}, second_), std::invalid_argument);
  EXPECT_THROW(bus_.attach({3, 31}, second_), std::invalid_argument);
  EXPECT_NO_THROW(bus_.attach({3, 1}, second_));
  EXPECT_NO_THROW(bus_.attach({3, 2}, second_));
  EXPECT_THROW(bus_.setFault({.at = {4}}), std::invalid_argument);
}

TEST_F(BusModelTest, HoldsStuckLines) {
  bus_.setFault({.kind = Kind::stuckActive, .lines = gpib_line::kNrfd});
  EXPECT_FALSE(hand_.command('!'));

  bus_.heal();
  EXPECT_TRUE(hand_.command('!'));
  bus_.setFault({.kind = Kind::stuckInactive, .lines = gpib_line::kDav});

  hand_.drive(gpib_line::kDav, 'x');
  EXPECT_FALSE(hand_.isActive(gpib_line::kDav));
  EXPECT_EQ(first_->text(), "");
}

TEST_F(BusModelTest, LosesAnInstrumentThatVanishes) {
  hand_.commands("!");
  bus_.setFault({.kind = Kind::vanished, .at = {1}});
  EXPECT_FALSE(hand_.data('x')) << "nobody accepts it";

  bus_.heal();

  EXPECT_FALSE(hand_.data('x')) << "its address is lost";
  hand_.commands("!");
  EXPECT_TRUE(hand_.data('y'));
  EXPECT_EQ(first_->text(), "y");
}

TEST_F(BusModelTest, KeepsTheLinesOfAnInstrumentThatIsFrozen) {
  hand_.commands("!");
  hand_.drive(0);
  bus_.setFault({.kind = Kind::frozen, .at = {1}});

  hand_.drive(gpib_line::kDav, 'x');

  EXPECT_TRUE(hand_.isActive(gpib_line::kNdac));
  EXPECT_FALSE(hand_.command('?')) << "it blocks commands, too";
}

TEST_F(BusModelTest, HasListenersThatTakeCommandsOnly) {
  bus_.setFault({.kind = Kind::neverAccepts, .at = {1}});

  EXPECT_TRUE(hand_.command('!'));
  EXPECT_FALSE(hand_.data('x'));
  EXPECT_TRUE(hand_.command('?'));
}

TEST_F(BusModelTest, BeginsAFaultAfterSoManyChanges) {
  hand_.commands("!");
  hand_.drive(gpib_line::kRen);
  const auto before = bus_.changes();
  EXPECT_TRUE(hand_.data('x'));
  const auto changes = bus_.changes() - before;
  bus_.setFaultAfter(changes + 1, {.kind = Kind::vanished, .at = {1}});

  EXPECT_TRUE(hand_.data('y'));
  static_cast<void>(hand_.data('z'));  // NDAC is inactive, because no device drives it

  EXPECT_EQ(first_->text(), "xy");
}

}  // namespace
}  // namespace mpf::test
