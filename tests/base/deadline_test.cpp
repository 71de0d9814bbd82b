// SPDX-License-Identifier: MIT
// Deadline::after(): waits that nanoseconds cannot represent.
#include <gtest/gtest.h>

#include <mpf/clock.h>

namespace mpf::test {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

TEST(Deadline, IsNeverAfterAWaitThatCannotBeRepresented) {
  EXPECT_TRUE(Deadline::after(Nanoseconds::max()).isNever());
  EXPECT_TRUE(Deadline::after(milliseconds::max()).isNever());
  EXPECT_TRUE(Deadline::after(hours::max()).isNever());
  EXPECT_TRUE(Deadline::after(hours(300 * 365 * 24)).isNever());
}

TEST(Deadline, HasPassedAfterAWaitOfNoTime) {
  EXPECT_TRUE(Deadline::after(milliseconds(0)).hasPassed());
  EXPECT_TRUE(Deadline::after(milliseconds::min()).hasPassed());
  EXPECT_TRUE(Deadline::after(Nanoseconds::min()).hasPassed());
}

TEST(Deadline, IsTheSameInEachUnit) {
  const auto before = Deadline::after(Nanoseconds(3'600'000'000'000));
  const auto deadline = Deadline::after(hours(1));
  EXPECT_GE(deadline, before);
  EXPECT_LE(deadline, Deadline::after(milliseconds(3'600'000)));
}

}  // namespace
}  // namespace mpf::test
