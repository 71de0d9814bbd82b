// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/gpib_operations.h"

#include <gmock/gmock.h>

#include <mpf/gpib_commands.h>

#include "tests/drivers/gpib/fake_controller.h"

namespace mpf::test {
namespace {

using namespace gpib;
using namespace std::chrono_literals;
using testing::ElementsAre;

class GpibOperationsTest : public testing::Test {
 protected:
  GpibReply perform(GpibRequest request) {
    request.until = Deadline::after(request.until.isNever() ? 60s : 0s);
    if (request.limits.maxBytes == 0) request.limits.maxBytes = 5;
    return performGpib(bus_, request, 7);
  }
  static GpibRequest at22(std::int32_t command, std::string_view data = {}) {
    return {.command = command, .addresses = {{22}}, .extra = 3, .data = bytesOf(data)};
  }

  FakeGpib fake_;
  GpibBus bus_{fake_.makeController()};
};

TEST_F(GpibOperationsTest, EachCommandIsItsOperation) {
  const auto statusOf = [&](const GpibRequest& request) { return perform(request).status; };
  EXPECT_EQ(statusOf(at22(cmdWrite, "x")), gpibStatusOK);
  EXPECT_EQ(statusOf(at22(cmdRead)), gpibStatusOK);
  EXPECT_EQ(statusOf(at22(cmdSerialPoll)), gpibStatusOK);
  EXPECT_EQ(statusOf(at22(cmdClear)), gpibStatusOK);
  EXPECT_EQ(statusOf({.command = cmdClear}), gpibStatusOK);
  EXPECT_EQ(statusOf(at22(cmdTrigger)), gpibStatusOK);
  EXPECT_EQ(statusOf({.command = cmdInterfaceClear}), gpibStatusOK);
  EXPECT_EQ(statusOf({.command = cmdRemoteEnable, .extra = 1}), gpibStatusOK);
  EXPECT_EQ(statusOf({.command = cmdRemoteEnable, .extra = 0}), gpibStatusOK);
  EXPECT_EQ(statusOf({.command = cmdLocalLockout}), gpibStatusUnsupported);
  EXPECT_EQ(statusOf(at22(cmdGoToLocal)), gpibStatusNoListener);
  EXPECT_EQ(statusOf({.command = cmdSendCommands, .data = bytesOf("_?")}), gpibStatusOK);

  EXPECT_THAT(fake_.operations(),
              ElementsAre("interface clear", "remote on", "write 22", "read 22", "poll 22",
                          "clear 22", "clear all", "trigger 22", "interface clear", "remote on",
                          "remote off", "lockout", "local 22", "commands _?"));
}

TEST_F(GpibOperationsTest, AReadSaysWhatEndedIt) {
  auto request = at22(cmdWriteRead, "12\n4");
  auto reply = perform(request);
  EXPECT_EQ(textOf(reply.value), "12\n4");
  EXPECT_EQ(reply.extra, gpibReadEndedByEnd);

  request.limits.endOfString = '\n';
  reply = perform(request);
  EXPECT_EQ(textOf(reply.value), "12\n");
  EXPECT_EQ(reply.extra, gpibReadEndedByString);

  request.limits = {.maxBytes = 2};
  request.isCountRequested = true;
  reply = perform(request);
  EXPECT_EQ(textOf(reply.value), "12");
  EXPECT_EQ(reply.extra, gpibReadEndedByCount);
  EXPECT_EQ(reply.status, gpibStatusOK);
}

TEST_F(GpibOperationsTest, AnAnswerLongerThanTheBufferIsAnOverflow) {
  const auto reply = perform(at22(cmdWriteRead, "123456"));

  EXPECT_EQ(reply.status, gpibStatusOverflow);
  EXPECT_EQ(textOf(reply.value), "12345");
}

TEST_F(GpibOperationsTest, AReadThatFailsHasNoEnd) {
  fake_.hang({22});
  auto request = at22(cmdRead);
  request.until = Deadline::atNs(0);

  const auto reply = perform(request);

  EXPECT_EQ(reply.status, gpibStatusTimeout);
  EXPECT_EQ(reply.extra, 0);
  EXPECT_EQ(reply.reason, "the instrument hangs");
}

TEST_F(GpibOperationsTest, APollReturnsTheStatusByte) {
  fake_.setStatus({22}, 0x51);

  EXPECT_THAT(perform(at22(cmdSerialPoll)).value, ElementsAre(0x51));
}

TEST_F(GpibOperationsTest, ALeaseIsThatOfTheClient) {
  const auto leased =
      perform({.command = cmdLease, .extra = 99'999, .lease = 5000ms, .data = bytesOf("scan")});
  EXPECT_EQ(leased.status, gpibStatusOK);
  EXPECT_EQ(leased.extra, 5000);
  ASSERT_TRUE(bus_.leaseHolder());
  EXPECT_EQ(bus_.leaseHolder()->user, 7U);
  EXPECT_EQ(bus_.leaseHolder()->name, "scan");
  EXPECT_EQ(performGpib(bus_, {.command = cmdClear, .until = Deadline::after(1ms)}, 8).status,
            gpibStatusLeased);

  EXPECT_EQ(perform({.command = cmdUnlease}).status, gpibStatusOK);

  EXPECT_FALSE(bus_.leaseHolder());
}

TEST_F(GpibOperationsTest, ALeaseWithoutANameNamesTheClient) {
  ASSERT_EQ(perform({.command = cmdLease, .lease = 5000ms}).status, gpibStatusOK);

  EXPECT_EQ(bus_.leaseHolder()->name, "client 7");
}

}  // namespace
}  // namespace mpf::test
