// SPDX-License-Identifier: MIT
// The log of a program: levels, storms, and the lines that are left at the end.
#include "server/programs/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/log_lines.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr auto kAtOnce = static_cast<std::size_t>(LogLimiter::kAtOnce);

class LogTest : public testing::Test {
 protected:
  // Logs from always the same statement.
  static void refuse(const Log& log, int number) { log.warn("request {} is refused", number); }

  std::int64_t nowNs_ = 1'000'000'000'000;
  std::vector<std::string> lines_;
  const Log log_{[this](Log::Level, std::string text) { lines_.push_back(std::move(text)); },
                 Log::Level::info, [this] { return nowNs_; }};
};

TEST_F(LogTest, WritesLinesOfItsLevelAndAbove) {
  log_.debug("no {}", 1);
  log_.info("yes {}", 2);
  log_.critical("yes");
  log_.setLevel("error");
  log_.warn("no");
  log_.error("yes {}", std::string("3"));

  EXPECT_THAT(lines_, ElementsAre("yes 2", "yes", "yes 3"));
}

TEST_F(LogTest, LimitsEachStatementByItself) {
  for (int i = 0; i < 1000; ++i) refuse(log_, i);
  log_.info("another statement");

  EXPECT_THAT(lines_, SizeIs(kAtOnce + 1));
  EXPECT_EQ(lines_.back(), "another statement");
}

TEST_F(LogTest, LimitsEachObjectByItself) {
  const auto other = log_.forObject();
  for (int i = 0; i < 1000; ++i) refuse(log_, i);
  refuse(other, -1);
  refuse(log_.forObject(), -2);

  EXPECT_THAT(lines_, SizeIs(kAtOnce + 2));
}

TEST_F(LogTest, ReportsWhenHeldLinesAreDueAndWritesThem) {
  std::vector<std::int64_t> due;
  log_.onHeld([&](std::int64_t dueNs) { due.push_back(dueNs); });
  for (int i = 0; i < 1000; ++i) refuse(log_, i);
  ASSERT_THAT(due, SizeIs(1));
  lines_.clear();

  EXPECT_EQ(log_.writeDue(), due[0]) << "no line is due yet";
  EXPECT_THAT(lines_, IsEmpty());
  nowNs_ = due[0];

  EXPECT_EQ(log_.writeDue(), INT64_MAX);
  EXPECT_THAT(lines_, ElementsAre("request 999 is refused (the last of 968 such lines in 10.0 s)"));
}

TEST_F(LogTest, CountsLinesOfAllThreads) {
  constexpr int kThreads = 4;
  constexpr int kEach = 5000;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([this] {
        for (int each = 0; each < kEach; ++each) refuse(log_, each);
      });
    }
  }
  log_.writeHeld();

  EXPECT_THAT(lines_, SizeIs(kAtOnce + 1));
  std::uint64_t all = 0;
  for (const auto& line : lines_) all += timesOf(line);
  EXPECT_EQ(all, std::uint64_t{kThreads} * kEach);
}

}  // namespace
}  // namespace mpf::test
