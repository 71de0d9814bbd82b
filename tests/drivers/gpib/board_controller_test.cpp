// SPDX-License-Identifier: MIT
#include "drivers/gpib/board_controller.h"

#include <array>
#include <gtest/gtest.h>
#include <string>
#include <string_view>
#include <vector>

namespace mpf::test {
namespace {

// Records the primitives: commands in hexadecimal, "send", "receive", "recover".
class RecordingBoard final : public GpibBoardController {
 public:
  explicit RecordingBoard(bool sendsOwnAddress = false)
      : GpibBoardController(sendsOwnAddress ? OwnAddress::sent : OwnAddress::implied) {}

  GpibResult interfaceClear(Deadline /*deadline*/) override { return {}; }
  GpibResult remoteEnable(bool /*on*/, Deadline /*deadline*/) override { return {}; }
  std::optional<bool> requestsService(Deadline /*deadline*/) override { return false; }
  bool onServiceRequest(std::function<void()> /*handler*/) override { return false; }
  void onPeek(GpibPeekHandler /*handler*/) override {}
  [[nodiscard]] std::string description() const override { return "a board"; }

  std::string takeLog() { return std::exchange(log_, {}); }
  // Lets the primitive fail that is recorded as this.
  void failAt(std::string_view entry) { failing_ = entry; }

 private:
  GpibResult record(const std::string& entry) {
    log_ += log_.empty() ? entry : "|" + entry;
    if (entry != failing_) return {};
    return {GpibStatus::timeout, "it did not answer"};
  }
  static std::string textOf(Bytes bytes) {
    static constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const auto byte : bytes) {
      if (!text.empty()) text += ' ';
      text += kDigits[byte >> 4];
      text += kDigits[byte & 0xf];
    }
    return text;
  }
  GpibResult command(Bytes commands, Deadline /*deadline*/) override {
    return record(textOf(commands));
  }
  GpibResult send(Bytes data, bool sendEnd, Deadline /*deadline*/) override {
    return record("send " + std::string(data.begin(), data.end()) + (sendEnd ? " END" : ""));
  }
  GpibReadResult receive(const GpibReadLimits& limits, Deadline /*deadline*/) override {
    return {record("receive " + std::to_string(limits.maxBytes)), {'R'}, true};
  }
  void recover(Bytes closing) override { static_cast<void>(record("recover " + textOf(closing))); }

  std::string log_;
  std::string failing_;
};

class BoardControllerTest : public testing::Test {
 protected:
  static constexpr std::array<std::uint8_t, 2> kData{'h', 'i'};
  RecordingBoard board_;
  Deadline never_ = Deadline::never();
};

TEST_F(BoardControllerTest, AddressesAListenerToWrite) {
  EXPECT_TRUE(board_.write({22}, kData, true, never_).ok());
  EXPECT_EQ(board_.takeLog(), "5f 3f 36|send hi END|5f 3f");
  EXPECT_TRUE(board_.write({22, 5}, kData, false, never_).ok());
  EXPECT_EQ(board_.takeLog(), "5f 3f 36 65|send hi|5f 3f");
  EXPECT_TRUE(board_.write({22}, {}, true, never_).ok());
  EXPECT_EQ(board_.takeLog(), "5f 3f 36|5f 3f");
}

TEST_F(BoardControllerTest, AddressesATalkerToRead) {
  const auto result = board_.read({22, 0}, {.maxBytes = 7}, never_);

  EXPECT_EQ(board_.takeLog(), "5f 3f 56 60|receive 7|5f 3f");
  EXPECT_EQ(result.data, (std::vector<std::uint8_t>{'R'}));
  EXPECT_TRUE(result.sawEnd);
}

TEST_F(BoardControllerTest, PollsOneInstrument) {
  EXPECT_EQ(board_.serialPoll({22}, never_).statusByte, 'R');
  EXPECT_EQ(board_.takeLog(), "5f 3f 18 56|receive 1|19 5f 3f");
}

TEST_F(BoardControllerTest, SendsOwnAddressToABoardThatNeedsIt) {
  RecordingBoard board(true);
  EXPECT_TRUE(board.write({22}, kData, true, never_).ok());
  EXPECT_TRUE(board.read({22}, {.maxBytes = 7}, never_).ok());
  EXPECT_TRUE(board.serialPoll({22}, never_).ok());
  EXPECT_EQ(board.takeLog(),
            "5f 3f 40 36|send hi END|5f 3f|5f 3f 56 20|receive 7|5f 3f|"
            "5f 3f 18 56 20|receive 1|19 5f 3f");
}

TEST_F(BoardControllerTest, ClearsAndTriggersListeners) {
  EXPECT_TRUE(board_.clear({1}, never_).ok());
  EXPECT_TRUE(board_.goToLocal({1}, never_).ok());
  EXPECT_TRUE(board_.trigger(std::array{GpibAddress{1}, GpibAddress{2, 3}}, never_).ok());
  EXPECT_EQ(board_.takeLog(), "5f 3f 21 04|5f 3f|5f 3f 21 01|5f 3f|5f 3f 21 22 63 08|5f 3f");
}

TEST_F(BoardControllerTest, SendsUniversalCommandsAlone) {
  EXPECT_TRUE(board_.clearAll(never_).ok());
  EXPECT_TRUE(board_.localLockout(never_).ok());
  EXPECT_TRUE(board_.sendCommands(kData, never_).ok());
  EXPECT_EQ(board_.takeLog(), "14|11|68 69");
}

TEST_F(BoardControllerTest, RecoversAfterAFailureOfEachStep) {
  board_.failAt("5f 3f 36");
  EXPECT_EQ(board_.write({22}, kData, true, never_).reason, "instrument 22: it did not answer");
  EXPECT_EQ(board_.takeLog(), "5f 3f 36|recover 5f 3f");
  board_.failAt("send hi END");
  EXPECT_EQ(board_.write({22}, kData, true, never_).status, GpibStatus::timeout);
  EXPECT_EQ(board_.takeLog(), "5f 3f 36|send hi END|recover 5f 3f");
}

// For example at the deadline: a status byte or an answer that was read is not lost.
TEST_F(BoardControllerTest, WhatWasExchangedStaysValidIfTheEndOfTheOperationFails) {
  board_.failAt("5f 3f");
  EXPECT_TRUE(board_.write({22}, kData, true, never_).ok());
  EXPECT_EQ(board_.takeLog(), "5f 3f 36|send hi END|5f 3f|recover 5f 3f");
  EXPECT_EQ(board_.read({22}, {.maxBytes = 7}, never_).data.size(), 1U);
  EXPECT_EQ(board_.takeLog(), "5f 3f 56|receive 7|5f 3f|recover 5f 3f");
  board_.failAt("19 5f 3f");
  const auto poll = board_.serialPoll({22}, never_);
  EXPECT_TRUE(poll.ok());
  EXPECT_EQ(poll.statusByte, 'R');
  EXPECT_EQ(board_.takeLog(), "5f 3f 18 56|receive 1|19 5f 3f|recover 19 5f 3f");
}

TEST_F(BoardControllerTest, RecoversFromAFailedReadWithItsData) {
  board_.failAt("receive 7");

  const auto result = board_.read({22}, {.maxBytes = 7}, never_);

  EXPECT_EQ(result.reason, "instrument 22: it did not answer");
  EXPECT_EQ(result.data.size(), 1U);
  EXPECT_EQ(board_.takeLog(), "5f 3f 56|receive 7|recover 5f 3f");
}

TEST_F(BoardControllerTest, EndsTheSerialPollAfterAFailure) {
  board_.failAt("receive 1");
  EXPECT_EQ(board_.serialPoll({22}, never_).status, GpibStatus::timeout);
  EXPECT_EQ(board_.takeLog(), "5f 3f 18 56|receive 1|recover 19 5f 3f");
}

TEST_F(BoardControllerTest, RecoversFromFailedCommands) {
  board_.failAt("14");
  EXPECT_EQ(board_.clearAll(never_).reason, "it did not answer");
  EXPECT_EQ(board_.takeLog(), "14|recover 5f 3f");
}

TEST_F(BoardControllerTest, RefusesAddressesThatNoInstrumentCanHave) {
  for (const auto& address : {GpibAddress{31}, GpibAddress{1, 31}, GpibAddress{0}}) {
    EXPECT_EQ(board_.write(address, kData, true, never_).status, GpibStatus::failure);
    EXPECT_EQ(board_.read(address, {.maxBytes = 1}, never_).status, GpibStatus::failure);
    EXPECT_EQ(board_.serialPoll(address, never_).status, GpibStatus::failure);
    EXPECT_EQ(board_.clear(address, never_).status, GpibStatus::failure);
    EXPECT_EQ(board_.trigger(std::array{address}, never_).status, GpibStatus::failure);
  }
  EXPECT_EQ(board_.read({1}, {.maxBytes = 0}, never_).status, GpibStatus::failure);
  EXPECT_EQ(board_.takeLog(), "") << "nothing was sent";
}

}  // namespace
}  // namespace mpf::test
