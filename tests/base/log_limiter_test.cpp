// SPDX-License-Identifier: MIT
// Repeated log lines: which lines are written, and that the counts add up. The tests set the time.
#include "base/log_limiter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

namespace mpf {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto kEveryNs = LogLimiter::kEveryNs;
constexpr LogLimiter::Kind kKind{"file.cpp", 10, 0};

class LogLimiterTest : public testing::Test {
 protected:
  bool admit(const std::string& text, const LogLimiter::Kind& kind = kKind, int level = 1) {
    return limiter_.admit(kind, level, text, nowNs_);
  }
  // Admits as many lines of one kind as are written at once.
  void useUp(const LogLimiter::Kind& kind = kKind) {
    for (auto i = LogLimiter::kAtOnce; i != 0; --i) EXPECT_TRUE(admit("first", kind)) << i;
  }
  static std::vector<std::string> texts(const std::vector<LogLimiter::Line>& lines) {
    std::vector<std::string> all;
    all.reserve(lines.size());
    for (const auto& line : lines) all.push_back(line.text);
    return all;
  }

  LogLimiter limiter_;
  std::int64_t nowNs_ = 1'000'000'000'000;
};

TEST_F(LogLimiterTest, WritesTheFirstLinesAtOnceAndHoldsTheRest) {
  useUp();

  EXPECT_FALSE(admit("one more"));

  EXPECT_EQ(limiter_.dueNs() % kEveryNs, nowNs_ % kEveryNs);
  EXPECT_GT(limiter_.dueNs(), nowNs_);
  EXPECT_LE(limiter_.dueNs(), nowNs_ + kEveryNs);
}

TEST_F(LogLimiterTest, CountsHeldLinesWithTheSameText) {
  useUp();
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(admit("status -1"));
  nowNs_ += kEveryNs;

  EXPECT_THAT(texts(limiter_.takeDue(nowNs_)),
              ElementsAre("status -1 (repeated 1000 times in 10.0 s)"));
  EXPECT_EQ(limiter_.dueNs(), INT64_MAX);
}

TEST_F(LogLimiterTest, KeepsTheLastOfHeldLinesThatDiffer) {
  useUp();
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(admit("request " + std::to_string(i)));
  nowNs_ += kEveryNs;

  EXPECT_THAT(texts(limiter_.takeDue(nowNs_)),
              ElementsAre("request 999 (the last of 1000 such lines in 10.0 s)"));
}

TEST_F(LogLimiterTest, WritesASingleHeldLineUnchanged) {
  useUp();
  EXPECT_FALSE(admit("late", kKind, 3));
  nowNs_ += kEveryNs;

  const auto due = limiter_.takeDue(nowNs_);

  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].text, "late");
  EXPECT_EQ(due[0].level, 3);
}

TEST_F(LogLimiterTest, ReturnsAllHeldLinesAtTheEnd) {
  useUp();
  EXPECT_FALSE(admit("last words"));

  EXPECT_THAT(texts(limiter_.takeDue(nowNs_)), IsEmpty());
  EXPECT_THAT(texts(limiter_.takeAll(nowNs_)), ElementsAre("last words"));
  EXPECT_THAT(texts(limiter_.takeAll(nowNs_)), IsEmpty());
}

TEST_F(LogLimiterTest, LimitsEachKindSeparately) {
  useUp();
  EXPECT_FALSE(admit("one more"));

  useUp({"file.cpp", 11, 0});
  useUp({"other.cpp", 10, 0});
  useUp({"file.cpp", 10, 1});
}

// A line is never written before held lines of its kind.
TEST_F(LogLimiterTest, HoldsALineWhileEarlierLinesOfItsKindAreHeld) {
  useUp();
  EXPECT_FALSE(admit("second"));
  nowNs_ += kEveryNs;

  EXPECT_FALSE(admit("third"));

  EXPECT_THAT(texts(limiter_.takeDue(nowNs_)),
              ElementsAre("third (the last of 2 such lines in 10.0 s)"));
}

TEST_F(LogLimiterTest, LetsAKindWriteAgainAfterSomeTime) {
  useUp();
  nowNs_ += 3 * kEveryNs;

  for (int i = 0; i < 3; ++i) EXPECT_TRUE(admit("again"));
  EXPECT_FALSE(admit("one more"));
  EXPECT_THAT(texts(limiter_.takeAll(nowNs_)), ElementsAre("one more"));
  nowNs_ += 2 * LogLimiter::kAtOnce * kEveryNs;
  useUp();
}

// A day of repeated lines, with pauses: few lines are written, and the counts include all lines.
TEST_F(LogLimiterTest, WritesFewOfManyLinesAndCountsAll) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::minstd_rand random(seed);
  constexpr std::int64_t kDayNs = 24LL * 3600 * 1'000'000'000;
  const auto endNs = nowNs_ + kDayNs;
  std::uint64_t said = 0;
  std::uint64_t counted = 0;
  std::uint64_t written = 0;
  const auto note = [&](const std::vector<LogLimiter::Line>& lines) {
    for (const auto& line : lines) {
      ++written;
      const auto at = line.text.find("repeated ");
      counted += at == std::string::npos ? 1 : std::stoull(line.text.substr(at + 9));
    }
  };

  while (nowNs_ < endNs) {
    for (auto burst = random() % 20; burst != 0; --burst, ++said) {
      if (admit("storm")) {
        ++written;
        ++counted;
      }
    }
    nowNs_ +=
        random() % 100 == 0 ? 60'000'000'000 : static_cast<std::int64_t>(random() % 3'000'000'000);
    if (limiter_.dueNs() <= nowNs_) note(limiter_.takeDue(nowNs_));
  }
  note(limiter_.takeAll(nowNs_));

  EXPECT_EQ(counted, said);
  EXPECT_LE(written, static_cast<std::uint64_t>(kDayNs / kEveryNs + LogLimiter::kAtOnce + 1));
}

}  // namespace
}  // namespace mpf
