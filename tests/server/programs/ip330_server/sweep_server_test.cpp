// SPDX-License-Identifier: MIT
// Arrays over time, and fast feedback.
#include "server/programs/ip330_server/sweep_server.h"

#include "tests/server/programs/ip330_server/ip330_fixture.h"

namespace mpf::test {
namespace {

using namespace ip330server;
using testing::Each;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(Ip330ServersTest, TakeArraysOfAllChannels) {
  EXPECT_EQ(tell("sweep", msgSetModeMcs), 0);
  EXPECT_EQ(tell("sweep", msgSetNChan, 5), 0);
  EXPECT_EQ(tell("sweep", msgSetDwell, 0.002), 0);
  EXPECT_EQ(tell("sweep", msgErase), 0);
  EXPECT_EQ(tell("sweep", msgAcquire), 0);
  while (askArray<Float64Array>("sweep", msgGetAcqStatus).values.at(0) != 0) {
  }

  const auto status = askArray<Float64Array>("sweep", msgGetAcqStatus);
  EXPECT_EQ(status.status, 0);
  ASSERT_THAT(status.values, SizeIs(5));
  EXPECT_GT(status.values[1], 0);
  EXPECT_DOUBLE_EQ(status.values[4], 2 * servers_.board().microsecondsPerScan() / 1e6);
  const auto first = askArray<Int32Array>("sweep", msgRead, 0);
  EXPECT_EQ(first.status, 0);
  EXPECT_THAT(
      first.values,
      testing::AllOf(SizeIs(5), Each(testing::AllOf(testing::Ge(49150), testing::Le(49154)))));
  const auto last = askArray<Int32Array>("sweep", msgRead, 3);
  EXPECT_THAT(
      last.values,
      testing::AllOf(SizeIs(5), Each(testing::AllOf(testing::Ge(32766), testing::Le(32770)))));
  const auto none = askArray<Int32Array>("sweep", msgRead, 4);
  EXPECT_EQ(none.status, -1);
  EXPECT_THAT(none.values, IsEmpty());
}

TEST_F(Ip330ServersTest, ReplyMinusOneWhenAnArrayIsTooLargeForAMessage) {
  carrier_.plug("IP_c", std::make_unique<Ip330Model>());
  IndustryPackModule module("small", "a model", carrier_.site(2), kIp330);
  Ip330Servers small(backplane_, {.maxMessageBytes = 256}, module, {.lastChannel = 3}, log_);
  small.addSweep("small", 20, 0, 3, 100);

  EXPECT_EQ(tell("small", msgRead), -1);

  EXPECT_EQ(tell("small", msgSetNChan, 50), 0);
  EXPECT_THAT(askArray<Int32Array>("small", msgRead).values, SizeIs(50));
}

TEST_F(Ip330ServersTest, FeedBackFromTheAdcToTheDac) {
  ASSERT_EQ(dac_.tryWrite(2, 1000), Dac128vStatus::success);
  EXPECT_EQ(tell("pid", cmdSetKP, 0.05), 0);
  EXPECT_EQ(tell("pid", cmdSetKI, 100), 0);
  EXPECT_EQ(tell("pid", cmdSetKD, 0), 0);
  EXPECT_EQ(tell("pid", cmdSetSetPoint, 36000), 0);
  EXPECT_EQ(tell("pid", cmdSetLowLimit, 100), 0);
  EXPECT_EQ(tell("pid", cmdSetHighLimit, 4000), 0);
  EXPECT_EQ(tell("pid", cmdSetSecondsPerScan, 0.001), 0);
  EXPECT_EQ(dac_.tryRead(2), 1000);
  EXPECT_EQ(tell("pid", cmdStartFeedback), 0);
  while (std::abs(askArray<Float64Array>("pid", cmdGetParams).values.at(offsetActual) - 36000) >
         10) {
  }

  EXPECT_EQ(tell("pid", cmdStopFeedback), 0);
  const auto params = askArray<Float64Array>("pid", cmdGetParams);
  EXPECT_EQ(params.status, 0);
  ASSERT_THAT(params.values, SizeIs(numFastPIDOffsets));
  EXPECT_DOUBLE_EQ(params.values[offsetSecondsPerScan],
                   servers_.board().microsecondsPerScan() / 1e6);
  const auto code = dac_.tryRead(2);
  waitForScans(5);
  EXPECT_EQ(dac_.tryRead(2), code);
}

TEST_F(Ip330ServersTest, ReportThatTheDacFails) {
  EXPECT_EQ(tell("pid", cmdStartFeedback), 0);
  carrier_.setFault("IP_b", ModelFault::busError);
  while (askArray<Float64Array>("pid", cmdGetParams).status == 0) {
  }
  while (alarms("pid") == 0) {
  }
  carrier_.setFault("IP_b", ModelFault::none);
  while (askArray<Float64Array>("pid", cmdGetParams).status != 0) {
  }
}

}  // namespace
}  // namespace mpf::test
