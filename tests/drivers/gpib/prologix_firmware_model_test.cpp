// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_firmware_model.h"

#include <gtest/gtest.h>
#include <memory>
#include <string>

#include "drivers/gpib/meter_model.h"
#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

class PrologixFirmwareModelTest : public testing::Test {
 protected:
  PrologixFirmwareModelTest() {
    firmware_.attach(kEcho, echo_);
    firmware_.attach(kOther, std::make_shared<MeterModel>());
    enter("++auto 0\n++addr 22\n++eos 3\n++read_tmo_ms 20\n");
  }
  // What the model sends while it executes these lines.
  std::string enter(std::string_view text) {
    sent_.clear();
    for (const char byte : text) {
      if (const auto line = lines_.add(byte)) firmware_.execute(*line);
    }
    return sent_;
  }

  std::shared_ptr<EchoInstrument> echo_ = std::make_shared<EchoInstrument>();
  std::string sent_;
  PrologixFirmwareModel::Lines lines_;
  // Time passes without waiting.
  PrologixFirmwareModel firmware_{{.send = [this](std::string_view text) { sent_ += text; },
                                   .pause = [](std::chrono::milliseconds) { return true; }}};
};

TEST_F(PrologixFirmwareModelTest, SendsItsVersion) {
  EXPECT_EQ(enter("++ver\r\n"), firmware_.version + "\r\n");
}

TEST_F(PrologixFirmwareModelTest, RemembersSettings) {
  EXPECT_EQ(enter("++eot_char 137\n++eot_char\n++mode\n"), "137\r\n1\r\n");
  EXPECT_EQ(enter("++addr 9 101\n++addr\n"), "9 101\r\n");
}

TEST_F(PrologixFirmwareModelTest, RefusesUnknownCommands) {
  EXPECT_EQ(enter("++toast\n"), "Unrecognized command\r\n");
  EXPECT_EQ(enter("++ren 1\n"), "Unrecognized command\r\n");
  EXPECT_EQ(enter("++addr 101\n++addr\n"), "Unrecognized command\r\n22\r\n");
  EXPECT_EQ(enter("++spoll 101\n"), "Unrecognized command\r\n");
  firmware_.hasRemoteEnable = true;
  EXPECT_EQ(enter("++ren 0\n++ren\n"), "0\r\n");
}

TEST_F(PrologixFirmwareModelTest, RemovesEscapesAndEndsOfLines) {
  enter("a\x1b\n\x1b+\x1b\x1b\x1b\r+\n");
  EXPECT_EQ(echo_->takeReceived(), "a\n+\x1b\r+");
}

TEST_F(PrologixFirmwareModelTest, EscapedPlusSignsAreData) {
  enter("\x1b++ver\n+\x1b+ver\n");
  EXPECT_EQ(echo_->takeReceived(), "++ver++ver");
}

TEST_F(PrologixFirmwareModelTest, AppendsTheEndOfString) {
  enter("++eos 0\na\n++eos 1\nb\n++eos 2\nc\n++eos 3\nd\n");
  EXPECT_EQ(echo_->takeReceived(), "a\r\nb\rc\nd");
  EXPECT_EQ(echo_->ends, 4);
}

TEST_F(PrologixFirmwareModelTest, SendsEndOnlyWhenEnabled) {
  enter("++eoi 0\na\n");
  EXPECT_EQ(echo_->ends, 0);
  enter("++eoi 1\nb\n");
  EXPECT_EQ(echo_->ends, 1);
}

TEST_F(PrologixFirmwareModelTest, ReadsAfterEachMessageWhenAutoIsOn) {
  EXPECT_EQ(enter("++auto 1\nhello\n"), "hello");
}

TEST_F(PrologixFirmwareModelTest, AppendsACharacterToEndWhenEnabled) {
  EXPECT_EQ(enter("++eot_enable 1\n++eot_char 42\nabc\n++read eoi\n"), "abc*");
}

TEST_F(PrologixFirmwareModelTest, ReadStopsAtACharacterButNotAtEnd) {
  EXPECT_EQ(enter("a;b\n++read 59\n"), "a;");
  EXPECT_EQ(enter("++read 59\n++ver\n"), "b" + firmware_.version + "\r\n");
}

TEST_F(PrologixFirmwareModelTest, ReadGivesUpWhenNothingComes) {
  EXPECT_EQ(enter("++read eoi\n"), "");
  EXPECT_EQ(enter("++addr 3\n++read\n"), "");
}

TEST_F(PrologixFirmwareModelTest, GivesUpAnInstrumentThatAcceptsNothing) {
  echo_->acceptsBytes = false;
  EXPECT_EQ(enter("abc\n++addr\n"), "22\r\n");
}

TEST_F(PrologixFirmwareModelTest, PollsAndReportsService) {
  EXPECT_EQ(enter("++srq\n++spoll\n"), "0\r\n1\r\n");
  echo_->wantsService = true;
  EXPECT_EQ(enter("++srq\n++spoll 22\n++srq\n"), "1\r\n65\r\n0\r\n");
  EXPECT_EQ(enter("++spoll 3\n"), "");
}

TEST_F(PrologixFirmwareModelTest, ClearsTriggersAndLocks) {
  enter("++clr\n++trg\n++trg 22 9 101\n++llo\n++ifc\n");
  EXPECT_EQ(echo_->clears, 1);
  EXPECT_EQ(echo_->triggers, 2);
  EXPECT_EQ(echo_->control, GpibInstrumentModel::Control::remoteWithLockout);
  enter("++loc\n");
  EXPECT_EQ(echo_->control, GpibInstrumentModel::Control::local);
}

TEST_F(PrologixFirmwareModelTest, AMeterAnswersBehindIt) {
  EXPECT_EQ(enter("++addr 9 101\nID?\n++read eoi\n"), "HP3458A\r\n");
}

}  // namespace
}  // namespace mpf::test
