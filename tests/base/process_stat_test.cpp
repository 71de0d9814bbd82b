// SPDX-License-Identifier: MIT
#include "base/process_stat.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "base/system_call.h"

namespace mpf {
namespace {

TEST(ProcessStat, HasTheNumbersOfAProcess) {
  const auto own = ProcessStat::tryReadOwn();
  const auto same = ProcessStat::tryRead(::getpid());
  constexpr int kParent = 4;

  ASSERT_TRUE(own && same);
  EXPECT_EQ(own->number(kParent), static_cast<std::uint64_t>(::getppid()));
  EXPECT_GT(own->number(ProcessStat::kStartTicks), 0U);
  EXPECT_EQ(own->number(ProcessStat::kStartTicks), same->number(ProcessStat::kStartTicks));
  EXPECT_EQ(own->number(1000), 0U);
  EXPECT_EQ(own->state(), 'R');
  EXPECT_EQ(ProcessStat().state(), '?');
  EXPECT_FALSE(own->hasEnded());
}

TEST(ProcessStat, TheNameOfTheProgramMayContainBracketsAndBlanks) {
  std::array<char, 16> before{};
  ASSERT_EQ(::prctl(PR_GET_NAME, before.data()), 0);
  const auto expected = ProcessStat::tryReadOwn();

  ASSERT_EQ(::prctl(PR_SET_NAME, "a) Z 1 (b) 2"), 0);
  const auto renamed = ProcessStat::tryReadOwn();
  ::prctl(PR_SET_NAME, before.data());

  ASSERT_TRUE(expected && renamed);
  EXPECT_FALSE(renamed->hasEnded());
  EXPECT_EQ(renamed->number(ProcessStat::kStartTicks), expected->number(ProcessStat::kStartTicks));
}

TEST(ProcessStat, KnowsAZombie) {
  const auto child = ::fork();
  if (child == 0) ::_exit(0);
  siginfo_t end{};
  ASSERT_EQ(retryInterrupted(
                [&] { return ::waitid(P_PID, static_cast<id_t>(child), &end, WEXITED | WNOWAIT); }),
            0);

  const auto stat = ProcessStat::tryRead(child);
  ASSERT_TRUE(stat);
  EXPECT_TRUE(stat->hasEnded());

  ASSERT_EQ(retryInterrupted([&] { return ::waitpid(child, nullptr, 0); }), child);
  EXPECT_FALSE(ProcessStat::tryRead(child));
}

}  // namespace
}  // namespace mpf
