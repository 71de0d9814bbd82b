// SPDX-License-Identifier: MIT
#include "base/timespec.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(Timespec, SplitsNanosecondsIntoSecondsAndARest) {
  const auto time = timespecOf(3'000'000'007);

  EXPECT_EQ(time.tv_sec, 3);
  EXPECT_EQ(time.tv_nsec, 7);
}

TEST(Timespec, ConvertsTheUnitOfADuration) {
  EXPECT_EQ(timespecOf(std::chrono::milliseconds(1500)).tv_sec, 1);
  EXPECT_EQ(timespecOf(std::chrono::microseconds(250)).tv_nsec, 250'000);
}

TEST(Timespec, SplitsTheLongestTime) {
  const auto time = timespecOf(INT64_MAX);

  EXPECT_EQ(time.tv_sec, 9'223'372'036);
  EXPECT_EQ(time.tv_nsec, 854'775'807);
}

}  // namespace
}  // namespace mpf::test
