// SPDX-License-Identifier: MIT
// KeepAlive: when a peer is silent for too long, and when this side sends pings. Time is a number.
#include "router/transport/keep_alive.h"

#include <gtest/gtest.h>

namespace mpf::router::test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStartNs = 1'000'000 * kMs;

Limits limits() {
  Limits limits;
  limits.deadTime = std::chrono::milliseconds(1000);
  limits.handshakeTime = std::chrono::milliseconds(700);
  return limits;
}

class KeepAliveTest : public testing::Test {
 protected:
  KeepAliveTest() { alive_.start(nowNs_); }
  // Does the next check when it is due, `lateNs` later. Returns its result.
  std::string checkNext(std::int64_t lateNs = 0) {
    nowNs_ += alive_.beginCheck(nowNs_) + lateNs;
    return alive_.check(nowNs_);
  }

  std::int64_t nowNs_ = kStartNs;
  KeepAlive alive_{limits()};
};

TEST_F(KeepAliveTest, ChecksAfterHalfOfTheDeadTime) {
  alive_.greetingReceived();

  EXPECT_EQ(alive_.beginCheck(nowNs_), 500 * kMs);
  EXPECT_EQ(alive_.beginCheck(nowNs_ + 900 * kMs), 100 * kMs) << "no later than the deadline";
  EXPECT_EQ(alive_.beginCheck(nowNs_ + 2000 * kMs), kMs) << "soon, when it has passed";
}

TEST_F(KeepAliveTest, OnlyTheSecondOverdueCheckInARowCounts) {
  alive_.greetingReceived();

  EXPECT_EQ(checkNext(), "");
  EXPECT_EQ(checkNext(), "") << "overdue, but data may not have been read yet";
  EXPECT_EQ(checkNext(), "received nothing from the peer for 1001 ms (dead-time)");
}

TEST_F(KeepAliveTest, ASignOfLifeAfterAnOverdueCheckSuffices) {
  alive_.greetingReceived();
  checkNext();
  checkNext();

  alive_.received(nowNs_);

  EXPECT_EQ(checkNext(), "");
  EXPECT_EQ(checkNext(), "") << "the first overdue check again";
}

TEST_F(KeepAliveTest, FramesDoNotReplaceTheGreeting) {
  std::string why;
  for (int i = 0; i < 4 && why.empty(); ++i) {
    alive_.frameReceived(nowNs_);
    why = checkNext();
  }

  EXPECT_EQ(why, "the peer sent no greeting within 700 ms (handshake-time)");
}

// For example when the process was stopped.
TEST_F(KeepAliveTest, TimeDuringWhichThisProcessDidNotRunDoesNotCount) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(checkNext(i == 0 ? 60'000 * kMs : 0), "") << i;
    alive_.greetingReceived();
    if (i != 0) alive_.received(nowNs_);
  }
}

TEST_F(KeepAliveTest, ManyBytesOfALongFrameAreASignOfLife) {
  alive_.greetingReceived();
  for (int i = 0; i < 10; ++i) {
    alive_.bytesReceived(64 << 10);
    EXPECT_EQ(checkNext(), "");
  }

  std::string why;
  for (int i = 0; i < 10 && why.empty(); ++i) {
    alive_.bytesReceived(1);
    why = checkNext();
  }
  EXPECT_NE(why, "") << "a few bytes are not";
}

TEST_F(KeepAliveTest, APingOfThePeerPostponesTheNextCheckOnce) {
  alive_.greetingReceived();

  ASSERT_TRUE(alive_.tryPostpone(nowNs_));
  EXPECT_FALSE(alive_.tryPostpone(nowNs_ + 1)) << "at most once in an eighth of the dead time";

  const auto afterNs = alive_.beginCheck(nowNs_);
  EXPECT_GE(afterNs, 625 * kMs);
  EXPECT_LE(afterNs, 750 * kMs);
  EXPECT_EQ(alive_.beginCheck(nowNs_), 500 * kMs) << "only one check was postponed";
}

TEST_F(KeepAliveTest, MeasuresWhenTheLastPingIsOld) {
  alive_.pingSent(nowNs_);

  EXPECT_FALSE(alive_.shouldMeasure(nowNs_ + 9'999 * kMs));
  EXPECT_TRUE(alive_.shouldMeasure(nowNs_ + 10'000 * kMs));
}

}  // namespace
}  // namespace mpf::router::test
