// SPDX-License-Identifier: MIT
// A test that dies leaves nothing. dying.cpp contains the tests that die.
#include "tests/support/guard.h"

#include <signal.h>
#include <sys/wait.h>

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ostream>
#include <sstream>
#include <string>

#include <mpf/backplane.h>

#include "tests/support/command.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// The value that a dying test printed after `word`, on a line of its own.
std::string valueOf(const std::string& word, const std::string& said) {
  std::istringstream lines(said);
  for (std::string first, value; lines >> first;) {
    if (first == word && lines >> value) return value;
  }
  ADD_FAILURE() << "no " << word << " in: " << said;
  return {};
}

// Runs a test of dying.cpp, even if this process runs only a part of its own tests.
auto runDying(const std::string& name) {
  return runCommand("unset GTEST_TOTAL_SHARDS GTEST_SHARD_INDEX; exec " MPF_TEST_DYING
                    " --gtest_filter=DyingTest." +
                    name + " 2>&1");
}

struct Death {
  std::string name;
  int status;  // expected status of the process
};
std::ostream& operator<<(std::ostream& out, const Death& death) { return out << death.name; }

#ifdef __SANITIZE_THREAD__
constexpr int kWatchdogSignal = SIGALRM;  // see watchdog.h
#else
constexpr int kWatchdogSignal = SIGABRT;
#endif

class GuardTest : public testing::TestWithParam<Death> {};

TEST_P(GuardTest, RemovesWhatADyingTestLeaves) {
  const Watchdog watchdog("guard test");

  const auto ended = runDying(GetParam().name);

  EXPECT_EQ(ended.status, GetParam().status) << ended.output;
  const auto backplane = Backplane::named(valueOf("backplane", ended.output));
  EXPECT_THAT(backplane.segmentNames(), IsEmpty());
  EXPECT_THAT(ended.output,
              HasSubstr("guard: removed 1 segments of backplane " + backplane.name()));
  EXPECT_THAT(Backplane::named(valueOf("other", ended.output)).segmentNames(), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(valueOf("folder", ended.output)));
  EXPECT_EQ(::kill(std::stoi(valueOf("child", ended.output)), 0), -1);
}

#ifndef __SANITIZE_THREAD__
TEST(WatchdogTest, PrintsTheStackOfEachThread) {
  const Watchdog watchdog("watchdog test");

  const auto ended = runDying("Hangs");

  EXPECT_THAT(ended.output, HasSubstr("watchdog: a test that hangs"));
  int threads = 0, pauses = 0;
  std::istringstream lines(ended.output);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("thread ")) ++threads;
    if (line.find("pause") != std::string::npos) ++pauses;
  }
  EXPECT_EQ(threads, 2) << ended.output;
  EXPECT_EQ(pauses, 2) << ended.output;
}
#endif

INSTANTIATE_TEST_SUITE_P(Of, GuardTest,
                         testing::Values(Death{"Hangs", kWatchdogSignal},
                                         Death{"IsKilled", SIGKILL},
                                         Death{"Ends", W_EXITCODE(3, 0)}),
                         [](const auto& death) { return death.param.name; });

}  // namespace
}  // namespace mpf::test
