// SPDX-License-Identifier: MIT
// Mean values of channels, and configuration.
#include "server/programs/ip330_server/scan_server.h"

#include "tests/server/programs/ip330_server/ip330_fixture.h"

namespace mpf::test {
namespace {

using namespace ip330server;

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
