// SPDX-License-Identifier: MIT
#include "drivers/serial/terminal_errors.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using Counts = TerminalErrors::Counts;

TEST(TerminalErrors, AnOverrunMakesBytesSuspectForSomeTime) {
  TerminalErrors errors;
  errors.begin(Counts{.framing = 0, .overruns = 7});
  EXPECT_EQ(errors.take(Counts{.framing = 0, .overruns = 7}, false), LineFault::framing);
  EXPECT_FALSE(errors.mayFollowGap()) << "overruns from before the device was opened do not count";

  const auto before = Clock::nowNs();
  errors.take(Counts{.framing = 0, .overruns = 10}, false);
  const bool isSuspect = errors.mayFollowGap();
  const bool isLate = Clock::nowNs() - before >= Nanoseconds(TerminalErrors::kMayBeLate).count();

  EXPECT_TRUE(isSuspect || isLate);
  EXPECT_EQ(errors.takeOverruns(), 3U);
  EXPECT_EQ(errors.takeOverruns(), 0U);
  while (errors.mayFollowGap()) {
  }
}

TEST(TerminalErrors, DamageIsParityUnlessFramingErrorsWereCounted) {
  TerminalErrors errors;
  errors.begin(Counts{});
  EXPECT_EQ(errors.take(Counts{}, true), LineFault::parity);
  EXPECT_EQ(errors.take(Counts{.framing = 1, .overruns = 0}, true), LineFault::framing);
  EXPECT_EQ(errors.take(Counts{.framing = 1, .overruns = 0}, true), LineFault::parity);
  EXPECT_EQ(errors.take(Counts{}, false), LineFault::framing)
      << "a line without parity has no parity errors";
}

TEST(TerminalErrors, WithoutCountersNoByteIsSuspect) {
  TerminalErrors errors;
  errors.begin(std::nullopt);
  EXPECT_EQ(errors.take(std::nullopt, true), LineFault::parity);
  EXPECT_FALSE(errors.mayFollowGap());
  EXPECT_EQ(errors.takeOverruns(), 0U);
}

}  // namespace
}  // namespace mpf::test
