// SPDX-License-Identifier: MIT
#include "server/programs/server_log.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/log_lines.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;

// What a log of `level` writes to stderr until its end.
template <class Use>
std::string loggedBy(const std::string& level, const Use& use) {
  testing::internal::CaptureStderr();
  {
    const ServerLog log("mpf-x", level);
    use(log);
  }
  return testing::internal::GetCapturedStderr();
}

TEST(ServerLog, ALineHasTheTimeTheLevelAndTheProgram) {
  const auto written =
      loggedBy("info", [](const ServerLog& log) { log->warn("{} is connected", "the line"); });

  EXPECT_THAT(written,
              MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2} [0-9]{2}:[0-9]{2}:[0-9]{2}\\.[0-9]{3} "
                           "warning mpf-x: the line is connected\n"));
}

TEST(ServerLog, EachOfItsLevelsHidesTheLowerOnes) {
  const auto& levels = ServerLog::levels();
  ASSERT_EQ(levels.size(), 7U);
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const auto written = loggedBy(levels[level], [](const ServerLog& log) {
      log->debug("of level 1");
      log->info("of level 2");
      log->warn("of level 3");
      log->error("of level 4");
      log->critical("of level 5");
    });
    for (std::size_t line = 1; line <= 5; ++line) {
      EXPECT_EQ(written.find("of level " + std::to_string(line)) != std::string::npos,
                line >= level)
          << levels[level];
    }
  }
}

TEST(ServerLog, ALineStaysOneLine) {
  const auto written =
      loggedBy("info", [](const ServerLog& log) { log->info("{}", "two\nlines, \x1b[2J"); });

  EXPECT_EQ(std::ranges::count(written, '\n'), 1);
  EXPECT_THAT(written, Not(HasSubstr("\x1b")));
}

// The limit on storms holds lines back; they are written at the latest when the program ends.
TEST(ServerLog, ItsEndWritesTheLinesThatWereHeld) {
  constexpr int kLines = 1000;

  const auto written = loggedBy("info", [](const ServerLog& log) {
    for (int i = 0; i < kLines; ++i) log->info("request {} is refused", i);
  });

  const auto count = countLines(written, "is refused");
  EXPECT_EQ(count.meant, kLines);
  EXPECT_LT(count.all, kLines);
  EXPECT_THAT(written, HasSubstr("request 999 is refused"));
}

TEST(ServerLog, WritesTheLinesOfAllThreadsInOneOrder) {
  constexpr int kThreads = 4;
  constexpr int kEach = 5;

  const auto written = loggedBy("info", [](const ServerLog& log) {
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < kThreads; ++thread) {
      threads.emplace_back([&log, thread] {
        for (int i = 0; i < kEach; ++i) log->info("line {} of thread {}", i, thread);
      });
    }
  });

  for (int thread = 0; thread < kThreads; ++thread) {
    std::size_t last = 0;
    for (int i = 0; i < kEach; ++i) {
      const auto at =
          written.find("line " + std::to_string(i) + " of thread " + std::to_string(thread));
      ASSERT_NE(at, std::string::npos);
      EXPECT_GE(at, last);
      last = at;
    }
  }
}

}  // namespace
}  // namespace mpf::test
