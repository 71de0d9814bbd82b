// SPDX-License-Identifier: MIT
#include "drivers/gpib/instrument_port.h"

#include <gtest/gtest.h>
#include <memory>

#include "tests/drivers/gpib/hand_controller.h"
#include "tests/drivers/gpib/memory_instrument.h"

namespace mpf::test {
namespace {

using namespace std::string_view_literals;

// An instrument at 22, which '6' and 'V' address to listen and to talk, and one at 23.5, which "7e"
// and "We" address.
class InstrumentPortTest : public testing::Test {
 protected:
  InstrumentPortTest() {
    bus_.attach({22}, plain_);
    bus_.attach({23, 5}, extended_);
  }
  GpibBusModel bus_;
  std::shared_ptr<MemoryInstrument> plain_ = std::make_shared<MemoryInstrument>();
  std::shared_ptr<MemoryInstrument> extended_ = std::make_shared<MemoryInstrument>();
  HandController hand_{bus_};
};

TEST_F(InstrumentPortTest, ListensFromItsAddressToUnlisten) {
  EXPECT_FALSE(hand_.data('a')) << "not addressed";

  hand_.commands("6");
  EXPECT_TRUE(hand_.data('b'));
  EXPECT_TRUE(hand_.data('c', true));
  hand_.commands("?");

  EXPECT_FALSE(hand_.data('d'));
  EXPECT_EQ(plain_->text(), "bc");
  EXPECT_EQ(plain_->ends, (std::vector{false, true}));
}

TEST_F(InstrumentPortTest, TalksUntilAnotherTalkerIsAddressed) {
  plain_->send("abc");
  hand_.commands("V");

  EXPECT_EQ(hand_.receive(), "a");
  hand_.commands("A");
  EXPECT_EQ(hand_.receive(), "");
  hand_.commands("V");
  EXPECT_EQ(hand_.receive(), "b");
  EXPECT_EQ(hand_.receive(), "c!");
  EXPECT_EQ(hand_.receive(), "");
}

TEST_F(InstrumentPortTest, EndsToTalkAtUntalkAndInterfaceClear) {
  plain_->send("abc");
  hand_.commands("V_");
  EXPECT_EQ(hand_.receive(), "");

  hand_.commands("V");
  hand_.drive(gpib_line::kIfc);

  EXPECT_EQ(hand_.receive(), "");
}

TEST_F(InstrumentPortTest, SendsAByteAgainThatWasInterrupted) {
  plain_->send("abc");
  hand_.commands("V");
  hand_.drive(gpib_line::kNdac);
  EXPECT_TRUE(hand_.isActive(gpib_line::kDav));

  hand_.drive(gpib_line::kAtn | gpib_line::kNdac);

  EXPECT_FALSE(hand_.isActive(gpib_line::kDav)) << "a talker gives way to commands";
  EXPECT_EQ(hand_.receive(), "a");
}

TEST_F(InstrumentPortTest, ForgetsTheInterruptedByteAtACommandOrAClear) {
  for (const auto& command : {"6"sv, "\x14"sv}) {
    plain_->send("ab");
    hand_.commands("V");
    hand_.drive(gpib_line::kNdac);
    hand_.commands("_");

    hand_.commands(command);
    static_cast<void>(hand_.data('x'));
    hand_.commands("?V");

    EXPECT_EQ(hand_.receive(), "b!") << command;
  }
}

TEST_F(InstrumentPortTest, WaitsWhileTheInstrumentDoesNotTakeAByte) {
  plain_->accepts = false;
  hand_.commands("6");
  hand_.drive(gpib_line::kRen);
  hand_.drive(gpib_line::kRen | gpib_line::kDav, 'a');
  EXPECT_TRUE(hand_.isActive(gpib_line::kNdac));

  plain_->accepts = true;
  bus_.proceed();

  EXPECT_FALSE(hand_.isActive(gpib_line::kNdac));
  EXPECT_EQ(plain_->text(), "a");
}

TEST_F(InstrumentPortTest, NeverTakesADataByteForACommand) {
  plain_->accepts = false;
  hand_.commands("6");
  hand_.drive(gpib_line::kRen);
  hand_.drive(gpib_line::kRen | gpib_line::kDav, 0x14);
  EXPECT_TRUE(hand_.isActive(gpib_line::kNdac));

  hand_.drive(gpib_line::kRen | gpib_line::kDav | gpib_line::kAtn, 0x14);

  EXPECT_EQ(plain_->log, "remote ") << "0x14 would be a device clear";
}

TEST_F(InstrumentPortTest, NeedsBothPartsOfAnExtendedAddress) {
  hand_.commands("7");
  EXPECT_FALSE(hand_.data('a'));
  hand_.commands("7d");
  EXPECT_FALSE(hand_.data('b'));
  hand_.commands("7?e");
  EXPECT_FALSE(hand_.data('c')) << "another address came between";
  hand_.commands("7e");
  EXPECT_TRUE(hand_.data('d'));
  EXPECT_EQ(extended_->text(), "d");
}

TEST_F(InstrumentPortTest, TalksAtAnExtendedAddressUntilAnotherSecondaryComes) {
  extended_->send("abc");
  hand_.commands("We");
  EXPECT_EQ(hand_.receive(), "a");
  hand_.commands("W");
  EXPECT_EQ(hand_.receive(), "b");
  hand_.commands("Wd");
  EXPECT_EQ(hand_.receive(), "");
}

TEST_F(InstrumentPortTest, AnswersASerialPollAndContinuesItsMessage) {
  plain_->send("ab");
  plain_->requestService(0x03);
  bus_.proceed();
  EXPECT_TRUE(hand_.isActive(gpib_line::kSrq));

  hand_.commands("\x18V");

  EXPECT_EQ(hand_.receive(), "C") << "0x43";
  EXPECT_FALSE(hand_.isActive(gpib_line::kSrq));
  hand_.commands("\x19");
  EXPECT_EQ(hand_.receive(), "a");
}

TEST_F(InstrumentPortTest, ExecutesAddressedCommandsAsAListener) {
  hand_.commands("\x08\x04");
  EXPECT_EQ(plain_->log, "");

  hand_.commands("6\x08\x04\x01");

  EXPECT_EQ(plain_->log, "remote trigger clear local ");
  EXPECT_EQ(extended_->log, "");
}

TEST_F(InstrumentPortTest, IgnoresTheEighthBitOfCommands) {
  hand_.command('6' | 0x80);
  EXPECT_TRUE(hand_.data('a'));
}

TEST_F(InstrumentPortTest, FollowsRemoteEnableAndLockout) {
  hand_.commands(
      "\x11"
      "6");
  EXPECT_EQ(plain_->log, "lockout ");

  hand_.drive(0);

  EXPECT_EQ(plain_->log, "lockout local ");
  hand_.commands("6");
  EXPECT_EQ(plain_->log, "lockout local remote ") << "the lockout has ended with REN";
}

TEST_F(InstrumentPortTest, AsksAllInstrumentsToClear) {
  hand_.commands("\x14");

  EXPECT_EQ(plain_->log, "clear ");
  EXPECT_EQ(extended_->log, "clear ");
}

}  // namespace
}  // namespace mpf::test
