// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_sync.h"

#include <gtest/gtest.h>
#include <string_view>

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t operator""_ms(unsigned long long ms) {
  return static_cast<std::int64_t>(ms) * 1'000'000;
}

constexpr LineLimits kLimits{.settleTime = 5ms, .quietTime = 100ms, .resyncLimit = 1000ms};

void receive(LineSync& sync, std::string_view bytes, std::int64_t atNs) {
  for (const char byte : bytes) sync.received(static_cast<std::uint8_t>(byte), atNs);
}

TEST(LineSync, ALineInStepNeedsTheSettleTimeBeforeAQuestion) {
  LineSync sync(kLimits);
  sync.asked("\r\n", 0);
  receive(sync, "1\r\n", 1000_ms);
  sync.answered();

  EXPECT_EQ(sync.readyAtNs(true), 1005_ms);
  EXPECT_EQ(sync.readyAtNs(false), 0);
}

TEST(LineSync, ALineWaitsForAMissingAnswer) {
  LineSync sync(kLimits);
  sync.asked("\r\n", 0);
  sync.unanswered(1000_ms);

  EXPECT_EQ(sync.readyAtNs(true), 2000_ms);
  EXPECT_EQ(sync.readyAtNs(false), 2000_ms) << "its answer could be mistaken for the late one";
}

TEST(LineSync, ALateAnswerIsOverAfterItsEndAndSilence) {
  LineSync sync(kLimits);
  sync.asked("\r\n", 0);
  receive(sync, "1", 999_ms);
  sync.unanswered(1000_ms);
  receive(sync, "2\r", 1200_ms);
  EXPECT_FALSE(sync.isWhole());
  EXPECT_EQ(sync.readyAtNs(true), 2000_ms);

  receive(sync, "\n", 1500_ms);

  EXPECT_TRUE(sync.isWhole());
  EXPECT_EQ(sync.readyAtNs(true), 1600_ms);
}

TEST(LineSync, ALateAnswerThatBeginsAtTheLastMomentIsCollected) {
  LineSync sync(kLimits);
  sync.asked("\r\n", 0);
  sync.unanswered(1000_ms);
  receive(sync, "1", 1999_ms);

  EXPECT_EQ(sync.readyAtNs(true), 2099_ms);
}

TEST(LineSync, ALateAnswerEndsAfterItsBytes) {
  LineSync sync(kLimits);
  sync.asked("", 3);
  sync.unanswered(1000_ms);
  receive(sync, "ab", 1200_ms);
  EXPECT_FALSE(sync.isWhole());

  receive(sync, "c", 1201_ms);

  EXPECT_EQ(sync.readyAtNs(true), 1301_ms);
}

TEST(LineSync, WithoutAKnownEndAnyInputIsTheAnswer) {
  LineSync sync(kLimits);
  sync.asked("", 0);
  receive(sync, "a", 1000_ms);
  sync.unanswered(1001_ms);

  EXPECT_EQ(sync.readyAtNs(true), 1100_ms);
}

TEST(LineSync, ASecondTimeoutOfTheSameQuestionDoesNotExtendTheWait) {
  LineSync sync(kLimits);
  sync.asked("\r", 0);
  sync.unanswered(1000_ms);
  sync.unanswered(1500_ms);

  EXPECT_EQ(sync.readyAtNs(true), 2000_ms);
}

TEST(LineSync, SurplusInputRequiresTheQuietTime) {
  LineSync sync(kLimits);
  sync.asked("\r", 0);
  receive(sync, "1\r", 1000_ms);
  sync.answered();
  receive(sync, "2\r", 1001_ms);
  EXPECT_FALSE(sync.isSurplusExpected());

  sync.noteSurplus();

  EXPECT_EQ(sync.readyAtNs(true), 1101_ms);
}

TEST(LineSync, AfterAPlainWriteInputIsExpected) {
  LineSync sync(kLimits);
  EXPECT_TRUE(sync.isSurplusExpected());
  sync.asked("\r", 0);
  sync.answered();

  sync.written(1000_ms);

  EXPECT_TRUE(sync.isSurplusExpected());
  EXPECT_EQ(sync.readyAtNs(true), 1005_ms) << "time for an acknowledgement";
}

}  // namespace
}  // namespace mpf::test
