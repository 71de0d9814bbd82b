// SPDX-License-Identifier: MIT
// TimeSampler: all messages of slow traffic are timed, and an even part of fast traffic.
#include "shm/time_sampler.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

// Sends messages at times of its own.
class Traffic {
 public:
  // Sends the next message. Returns whether it was timed.
  bool send() {
    const bool isTimed = sampler_.isDue(sent_);
    if (isTimed) sampler_.note(sent_, nowNs_);
    ++sent_;
    return isTimed;
  }
  void pass(std::int64_t ns) { nowNs_ += ns; }

  int timedOf(int messages, std::int64_t intervalNs) {
    int timed = 0;
    for (int i = 0; i < messages; ++i) {
      timed += send() ? 1 : 0;
      pass(intervalNs);
    }
    return timed;
  }

 private:
  TimeSampler sampler_;
  std::uint64_t sent_ = 0;
  std::int64_t nowNs_ = 1'000'000'000;
};

TEST(TimeSampler, TimesAllMessagesOfSlowTraffic) {
  Traffic traffic;

  EXPECT_EQ(traffic.timedOf(10'000, 20'000), 10'000);
}

TEST(TimeSampler, TimesOneIn64OfFastTraffic) {
  Traffic traffic;
  traffic.timedOf(100'000, 103);

  EXPECT_NEAR(traffic.timedOf(640'000, 103), 10'000, 1000);
}

TEST(TimeSampler, TimesOneFor16MicrosecondsOfTrafficBetween) {
  Traffic traffic;
  traffic.timedOf(10'000, 2103);

  EXPECT_NEAR(traffic.timedOf(80'000, 2103), 10'000, 1000);
}

TEST(TimeSampler, TimesThePartsOfABurstEvenly) {
  Traffic traffic;
  traffic.timedOf(100'000, 103);
  int first = 0, all = 0;
  for (int burst = 0; burst < 10'000; ++burst) {
    const int timed = traffic.timedOf(8, 103);
    first += timed;
    all += timed + traffic.timedOf(56, 103);
    traffic.pass(5007);
  }

  EXPECT_NEAR(first, all / 8.0, all / 50.0);
}

TEST(TimeSampler, TimesAllMessagesAgainSoonAfterFastTraffic) {
  Traffic traffic;
  traffic.timedOf(100'000, 103);
  traffic.pass(1'000'000'000);

  const int timed = traffic.timedOf(96, 20'000);

  EXPECT_GE(timed, 1);
  EXPECT_EQ(traffic.timedOf(100, 20'000), 100);
}

TEST(TimeSampler, TimesEachAttemptToSendAMessageThatIsDue) {
  TimeSampler sampler;
  sampler.note(0, 1'000'000'000);

  EXPECT_TRUE(sampler.isDue(0));
}

TEST(TimeSampler, TimesFewMessagesOfALongBurstAfterARest) {
  Traffic traffic;
  traffic.timedOf(100, 20'000);
  traffic.pass(1'000'000'000);

  EXPECT_LE(traffic.timedOf(2048, 103), 1200);
}

}  // namespace
}  // namespace mpf::test
