// SPDX-License-Identifier: MIT
// What all servers of one IP330 have in common: refusals, faults of the board.
#include "tests/server/programs/ip330_server/ip330_fixture.h"

namespace mpf::test {
namespace {

using namespace ip330server;

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

TEST_F(Ip330ServersTest, ReplyMinusOneWhileTheBoardFailsAndContinue) {
  EXPECT_EQ(ask("scan", {.address = 0}).status, 0);
  EXPECT_EQ(alarms("scan"), 0u);
  carrier_.setFault("IP_a", ModelFault::busError);
  while (ask("scan", {.address = 0}).status == 0) {
  }
  for (const auto* const name : {"scan", "config", "sweep", "pid"}) {
    while (alarms(name) == 0) std::this_thread::yield();
  }
  EXPECT_EQ(ask("config", {.cmd = cmdCalibrate}).status, -1);
  EXPECT_EQ(askArray<Float64Array>("sweep", msgGetAcqStatus).status, -1);
  EXPECT_EQ(askArray<Float64Array>("pid", cmdGetParams).status, -1);
  carrier_.setFault("IP_a", ModelFault::none);
  while (ask("scan", {.address = 0}).status != 0) {
  }
  EXPECT_NEAR(ask("scan", {.address = 0, .extra = 1}).value, 49152, 2);
}

}  // namespace
}  // namespace mpf::test
