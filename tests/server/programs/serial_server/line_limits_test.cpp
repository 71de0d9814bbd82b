// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_limits.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <string>
#include <utility>

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

LineLimits parseLimits(const std::string& line) {
  LineLimits limits;
  CLI::App app;
  limits.addTo(app);
  app.parse(line);
  return limits;
}

TEST(LineLimits, OptionsThatAreLeftOutKeepTheDefaults) {
  const auto limits = parseLimits("--quiet-time 250ms");

  EXPECT_EQ(limits.settleTime, LineLimits().settleTime);
  EXPECT_EQ(limits.quietTime, 250ms);
  EXPECT_EQ(limits.resyncLimit, LineLimits().resyncLimit);
  EXPECT_EQ(limits.maxTimeout, LineLimits().maxTimeout);
  EXPECT_EQ(limits.maxRetries, LineLimits().maxRetries);
}

TEST(LineLimits, EachOptionSetsItsLimit) {
  const auto limits = parseLimits(
      "--settle-time 1ms --quiet-time 0.2 --resync-limit 3s --max-timeout 1.5min --max-retries 5");

  EXPECT_EQ(limits.settleTime, 1ms);
  EXPECT_EQ(limits.quietTime, 200ms);
  EXPECT_EQ(limits.resyncLimit, 3s);
  EXPECT_EQ(limits.maxTimeout, 90s);
  EXPECT_EQ(limits.maxRetries, 5);
}

TEST(LineLimits, EachOptionAcceptsItsBoundsAndNothingBeyond) {
  struct Range {
    std::string option;
    long least, most;
  };
  for (const auto& [option, least, most] :
       {Range{"--settle-time", 0, 3600}, Range{"--quiet-time", 0, 3600},
        Range{"--resync-limit", 0, 3600}, Range{"--max-timeout", 1, 86'400},
        Range{"--max-retries", 0, 1'000'000}}) {
    const auto with = [&](long value) { return option + "=" + std::to_string(value); };
    EXPECT_NO_THROW(parseLimits(with(least))) << option;
    EXPECT_NO_THROW(parseLimits(with(most))) << option;
    EXPECT_THROW(parseLimits(with(least - 1)), CLI::ParseError) << option;
    EXPECT_THROW(parseLimits(with(most + 1)), CLI::ParseError) << option;
  }
}

TEST(LineLimits, TheHelpShowsTheDefaults) {
  LineLimits limits;
  CLI::App app;
  limits.addTo(app);

  for (const auto& [option, value] :
       {std::pair("--settle-time", "5ms"), std::pair("--quiet-time", "100ms"),
        std::pair("--resync-limit", "1s"), std::pair("--max-timeout", "1min"),
        std::pair("--max-retries", "10")})
    EXPECT_EQ(app.get_option(option)->get_default_str(), value);
}

TEST(LineLimits, TheLongestSyncIsALateAnswerAndTheLongerSilence) {
  EXPECT_EQ(
      (LineLimits{.settleTime = 5ms, .quietTime = 100ms, .resyncLimit = 1000ms}.longestSync()),
      1100ms);
  EXPECT_EQ((LineLimits{.settleTime = 300ms, .quietTime = 100ms, .resyncLimit = 1s}.longestSync()),
            1300ms);
}

}  // namespace
}  // namespace mpf::test
