// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "benchmarks/hardware/hardware.h"

namespace mpf::bench {
namespace {

using testing::HasSubstr;
using testing::Not;

// The result of a row with a message rate, and the ratio of that rate to the floor's.
Result askedRow(const std::string& question, const std::string& name, double perSecond,
                double timesFloor) {
  Result result;
  result.measurement.question = question;
  result.measurement.name = name;
  result.measurement.floorName = question == kServers ? kEcho : kManualLocal;
  result.figures.perSecond = perSecond;
  result.figures.latency.add(1000);
  result.floorNs = 1e9 / perSecond * timesFloor;
  result.ratioToFloor = 1 / timesFloor;
  return result;
}

TEST(HardwareTable, ShowsTheRatioToTheEcho) {
  const auto text =
      hardwareTable({askedRow(kServers, "mpf-dac128v-server, an output set", 20e3, 0.5)});

  EXPECT_THAT(text, HasSubstr("x echo"));
  EXPECT_THAT(text, HasSubstr(" 20.0 k/s "));
  EXPECT_THAT(text, HasSubstr(" 0.500  40.0 k/s: mpf-int32-server, the echo\n"));
}

TEST(HardwareTable, ShowsTheRatioToTheManualAndThatThatIsNotMeasured) {
  Result manual;
  manual.measurement.question = kSerial;
  manual.measurement.name = kManualLocal;
  manual.measurement.detail = kNotMeasured;
  manual.figures.perSecond = 159;
  auto cpu = manual;
  cpu.measurement.unit = "% of one CPU";
  cpu.figures.value = 89;

  const auto text = hardwareTable({manual, cpu, askedRow(kSerial, "written", 318, 2)});

  EXPECT_THAT(text, HasSubstr("x manual"));
  EXPECT_THAT(text, HasSubstr("not measured here\n"));
  EXPECT_THAT(text, HasSubstr(" 89 % of one CPU, not measured here\n"));
  EXPECT_THAT(text, HasSubstr(" 2.000  159 /s: the manual's, local\n"));
}

TEST(HardwareTable, HasOneHeadingAndValuesWithTheirUnit) {
  Result share;
  share.measurement.question = kScanning;
  share.measurement.name = "the driver's thread";
  share.measurement.unit = "% of one CPU";
  share.figures.value = 1.25;

  const auto text = hardwareTable({share, share});

  EXPECT_EQ(text.find(kScanning), text.rfind(kScanning));
  EXPECT_THAT(text, HasSubstr(" 1.25 % of one CPU\n"));
  EXPECT_THAT(text, Not(HasSubstr("p99")));
}

// A row about lost characters shows the faults that the server reported.
TEST(HardwareTable, ShowsTheFaultsOfLostCharacters) {
  Result lost;
  lost.measurement.question = kSerial;
  lost.measurement.name = "written, echo read: characters were lost";
  lost.measurement.unit = kShortAnswers;
  lost.figures.value = 3;
  lost.figures.lineFaults = {.shortAnswers = 3, .overruns = 2, .framing = 1};
  auto unexplained = lost;
  unexplained.figures.lineFaults = {.shortAnswers = 3};

  EXPECT_THAT(
      hardwareTable({lost}),
      HasSubstr(" 3 answers; with overruns 2, parity errors 0, framing errors 1, breaks 0\n"));
  EXPECT_THAT(hardwareTable({unexplained}),
              HasSubstr("breaks 0: the server reported no line fault\n"));
}

TEST(HardwareTable, NamesWhatWasLeftOutAndWhatFailed) {
  auto leftOut = askedRow(kServers, "one", 1, 1);
  leftOut.measurement.skipped = "mpf-ip330-server does not exist";
  auto failed = askedRow(kServers, "other", 1, 1);
  failed.error = "mpf-dac128v-server has ended: bad luck";

  const auto text = hardwareTable({leftOut, failed});

  EXPECT_THAT(text, HasSubstr("left out: mpf-ip330-server does not exist"));
  EXPECT_THAT(text, HasSubstr("failed: mpf-dac128v-server has ended: bad luck"));
}

}  // namespace
}  // namespace mpf::bench
