// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_faults.h"

#include <gmock/gmock.h>
#include <utility>
#include <vector>

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

constexpr std::array kAllFaults{Ip330Fault::absent, Ip330Fault::silent, Ip330Fault::interruptsLost,
                                Ip330Fault::storm, Ip330Fault::notCalibrated};

class Ip330FaultsTest : public testing::Test {
 protected:
  std::vector<std::pair<std::string, bool>> told_;
  Ip330Faults faults_{
      [this](const std::string& text, bool isThere) { told_.emplace_back(text, isThere); }};
};

TEST_F(Ip330FaultsTest, ReportTheBeginningAndTheEndOfAFaultOnce) {
  faults_.set(Ip330Fault::silent, false);
  EXPECT_THAT(told_, IsEmpty()) << "it was not there";

  for (int i = 0; i < 2; ++i) faults_.set(Ip330Fault::silent, true);
  EXPECT_TRUE(faults_.has(Ip330Fault::silent));
  for (int i = 0; i < 2; ++i) faults_.set(Ip330Fault::silent, false);

  EXPECT_FALSE(faults_.has(Ip330Fault::silent));
  EXPECT_THAT(told_, ElementsAre(Pair("the board does not scan", true),
                                 Pair("the board scans again", false)));
}

TEST_F(Ip330FaultsTest, HaveSentencesOfTheirOwn) {
  for (const auto fault : kAllFaults) {
    faults_.set(fault, true);
    EXPECT_EQ(faults_.describe(), told_.back().first);
    for (const auto other : kAllFaults) EXPECT_EQ(faults_.has(other), other == fault);
    faults_.set(fault, false);
  }
  EXPECT_THAT(
      told_,
      ElementsAre(Pair(HasSubstr("is gone"), true), Pair(HasSubstr("present"), false),
                  Pair(HasSubstr("does not scan"), true), Pair(HasSubstr("scans again"), false),
                  Pair(HasSubstr("interrupts do not come"), true),
                  Pair(HasSubstr("interrupts come again"), false),
                  Pair(HasSubstr("without a reason"), true), Pair(HasSubstr("quiet again"), false),
                  Pair(HasSubstr("calibration fails"), true),
                  Pair(HasSubstr("calibration succeeds"), false)));
}

TEST_F(Ip330FaultsTest, AreDescribedByTheWorstOne) {
  EXPECT_EQ(faults_.describe(), "");
  faults_.set(Ip330Fault::notCalibrated, true);
  faults_.set(Ip330Fault::absent, true);
  faults_.set(Ip330Fault::storm, true);

  EXPECT_THAT(faults_.describe(), HasSubstr("the board is gone"));

  faults_.set(Ip330Fault::absent, false);
  EXPECT_THAT(faults_.describe(), HasSubstr("interrupts without a reason"));
}

TEST(Ip330FaultsWithoutHook, AreKept) {
  Ip330Faults faults({});
  faults.set(Ip330Fault::storm, true);
  EXPECT_TRUE(faults.has(Ip330Fault::storm));
}

}  // namespace
}  // namespace mpf::test
