// SPDX-License-Identifier: MIT
// The servers of one IP330, through clients.
#include "ip330_fixture.h"

namespace mpf::test {
namespace {

using namespace ip330server;
using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(Ip330ServersTest, ReturnTheCorrectedMeanOfAChannel) {
  const auto reply = ask("scan", {.address = 0, .value = 0});
  EXPECT_EQ(reply.status, 0);
  EXPECT_NEAR(reply.value, 49152, 2);
  EXPECT_EQ(reply.address, 0);
  const auto averaged = ask("scan", {.address = 0, .extra = 20, .value = 0});
  EXPECT_EQ(averaged.status, 0);
  EXPECT_NEAR(averaged.value, 49152, 2);
}

TEST_F(Ip330ServersTest, SetTheGainOfAChannelPerRequest) {
  volts_ = 0.5;
  EXPECT_NEAR(ask("scan", {.address = 1, .value = 2}).value, 32768 + 4 * 3277, 2);
  EXPECT_NEAR(ask("scan", {.address = 1, .value = 0}).value, 32768 + 3277, 2);
  EXPECT_EQ(servers_.board().gain(1), 0);
}

TEST_F(Ip330ServersTest, ReplyMinusOneToInvalidRequests) {
  for (const auto& request :
       {Int32{.address = -1}, Int32{.address = 4}, Int32{.address = INT32_MAX}, Int32{.value = 4},
        Int32{.value = -1}, Int32{.extra = -1}, Int32{.extra = INT32_MAX}}) {
    EXPECT_EQ(ask("scan", request).status, -1)
        << request.address << ' ' << request.value << ' ' << request.extra;
  }
  EXPECT_EQ(ask("config", {.cmd = 5}).status, -1);
  EXPECT_EQ(ask("config", {.cmd = cmdSetScanMode, .value = 6}).status, -1);
  EXPECT_EQ(ask("config", {.cmd = cmdSetMicrosecondsPerScan, .value = 10}).status, -1);
  EXPECT_EQ(tell("sweep", 20), -1);
  EXPECT_EQ(tell("sweep", -1), -1);
  EXPECT_EQ(tell("sweep", msgSetNChan, 101), -1);
  EXPECT_EQ(tell("pid", 11), -1);
  EXPECT_EQ(tell("pid", cmdSetKP, std::numeric_limits<double>::quiet_NaN()), -1);
  EXPECT_EQ(ask("scan", {.address = 0}).status, 0);
}

TEST_F(Ip330ServersTest, ReplyToMessagesOfOtherTypes) {
  for (const auto* const name : {"scan", "config", "sweep", "pid"}) {
    SyncClient client(backplane_, name);
    auto array = call(client, Char8ArrayMessage::allocValue(3)).as<Char8Array>();
    ASSERT_TRUE(array) << name;
    EXPECT_EQ((*array)->status, -1) << name;
  }
  EXPECT_EQ(tell("scan", 0), -1);
  EXPECT_EQ(tell("config", 0), -1);
  EXPECT_EQ(ask("sweep", {}).status, -1);
  EXPECT_EQ(ask("pid", {}).status, -1);
}

TEST_F(Ip330ServersTest, AreConfiguredWhileTheyServe) {
  const auto calibrations = servers_.board().counters().calibrations;
  EXPECT_EQ(ask("config", {.cmd = cmdSetSecondsBetweenCalibrate, .value = 0}).status, 0);
  EXPECT_EQ(ask("config", {.cmd = cmdCalibrate}).status, 0);
  EXPECT_EQ(servers_.board().counters().calibrations, calibrations + 2);
  const auto time = ask("config", {.cmd = cmdSetMicrosecondsPerScan, .value = 2001});
  EXPECT_EQ(time.status, 0);
  EXPECT_EQ(time.value, 2004);  // the nearest time of the timer
  EXPECT_EQ(ask("config", {.cmd = cmdSetScanMode, .value = 1}).status, 0);
  EXPECT_EQ(ask("scan", {.address = 0}).status, 0);
  EXPECT_EQ(ask("config", {.cmd = cmdSetScanMode, .value = 4}).status, 0);
  EXPECT_EQ(ask("config", {.cmd = cmdStartConvert}).status, 0);
  EXPECT_EQ(ask("config", {.cmd = cmdSetSecondsBetweenCalibrate, .value = -1}).status, 0);
}

TEST_F(Ip330ServersTest, ReplyMinusOneWhenAConversionDoesNotStart) {
  EXPECT_EQ(ask("config", {.cmd = cmdStartConvert}).status, -1);  // the board scans by itself
  EXPECT_EQ(ask("config", {.cmd = cmdSetScanMode, .value = 0}).status, 0);
  EXPECT_EQ(ask("config", {.cmd = cmdStartConvert}).status, -1);
  EXPECT_EQ(ask("config", {.cmd = cmdSetScanMode, .value = 4}).status, 0);
  EXPECT_EQ(ask("config", {.cmd = cmdStartConvert}).status, 0);
  carrier_.setFault("IP_a", ModelFault::busError);
  EXPECT_EQ(ask("config", {.cmd = cmdStartConvert}).status, -1);
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

TEST_F(Ip330ServersTest, ReplyMinusOneWhileTheBoardFailsAndContinue) {
  EXPECT_EQ(ask("scan", {.address = 0}).status, 0);
  EXPECT_EQ(alarms("scan"), 0u);
  carrier_.setFault("IP_a", ModelFault::busError);
  while (ask("scan", {.address = 0}).status == 0) {
  }
  for (const auto* const name : {"scan", "config", "sweep", "pid"})
    EXPECT_GE(alarms(name), 1u) << name;
  EXPECT_EQ(ask("config", {.cmd = cmdCalibrate}).status, -1);
  EXPECT_EQ(askArray<Float64Array>("sweep", msgGetAcqStatus).status, -1);
  EXPECT_EQ(askArray<Float64Array>("pid", cmdGetParams).status, -1);
  carrier_.setFault("IP_a", ModelFault::none);
  while (ask("scan", {.address = 0}).status != 0) {
  }
  EXPECT_NEAR(ask("scan", {.address = 0, .extra = 1}).value, 49152, 2);
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

TEST_F(Ip330ServersTest, ReportThatCalibrationDoesNotEndAndContinue) {
  adc_.setStuck(true);
  EXPECT_EQ(ask("config", {.cmd = cmdCalibrate}).status, -1);
  adc_.setStuck(false);
  while (ask("config", {.cmd = cmdCalibrate}).status != 0) {
  }
  while (ask("scan", {.address = 0}).status != 0) {
  }
}

}  // namespace
}  // namespace mpf::test
