// SPDX-License-Identifier: MIT
#include "crate/capsule/core_file.h"

#include <unistd.h>

#include <gmock/gmock.h>

namespace mpf::crate::test {
namespace {

std::string pathFor(const std::string& pattern, bool usesPid = false) {
  return corePathPattern(pattern, usesPid, {.pid = 77, .folder = "/run/x"});
}

TEST(CorePathPattern, IsInTheFolderOfTheProcess) {
  EXPECT_EQ(pathFor("core"), "/run/x/core");
  EXPECT_EQ(pathFor("core", true), "/run/x/core.77");
  EXPECT_EQ(pathFor("/var/core"), "/var/core");
}

TEST(CorePathPattern, HasThePidAndAsterisksForWhatIsNotKnown) {
  EXPECT_EQ(pathFor("/c/core.%p", true), "/c/core.77");
  EXPECT_EQ(pathFor("/c/%e-%t-%p"), "/c/*-*-77");
  EXPECT_EQ(pathFor("/c/100%%"), "/c/100%");
  EXPECT_EQ(pathFor("/c/core%"), "/c/core");
}

TEST(CorePathPattern, MatchesOnlyTheFolderOfTheProcess) {
  EXPECT_EQ(corePathPattern("core", false, {.pid = 77, .folder = "/run/[x]*?"}),
            "/run/\\[x]\\*\\?/core");
}

TEST(CorePathPattern, IsEmptyWhenAProgramReceivesTheCores) {
  EXPECT_EQ(pathFor("|/usr/lib/systemd/systemd-coredump %P"), "");
}

TEST(DescribeCore, SaysThatThereIsNoCore) {
  const auto tree =
      describeCore({.pid = ::getpid(), .folder = "/nonexistent"}, std::chrono::seconds(60));

  ASSERT_TRUE(tree.contains("problem")) << tree;
}

}  // namespace
}  // namespace mpf::crate::test
