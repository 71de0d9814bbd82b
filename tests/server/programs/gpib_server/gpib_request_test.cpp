// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/gpib_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mpf/gpib_commands.h>

namespace mpf::test {
namespace {

using namespace gpib;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const GpibLimits kLimits{
    .bufferBytes = 1000, .timeout = 3s, .maxTimeout = 60s, .maxLease = std::chrono::seconds(10)};

GpibRequest requestOf(const Char8Array& fields, std::string_view value = {}) {
  auto message = Char8ArrayMessage::allocValue(value.size());
  *message = fields;
  message.setSize(value.size());
  std::ranges::copy(value, message.value().begin());
  return GpibRequest::from(message, kLimits);
}

TEST(GpibRequest, HasACommandAnAddressAndData) {
  const auto request = requestOf({.cmd = cmdWrite | cmdWithoutEnd, .address = 502}, "ID?");

  EXPECT_EQ(request.problem, "");
  EXPECT_EQ(request.command, cmdWrite);
  EXPECT_FALSE(request.sendEnd);
  EXPECT_THAT(request.addresses, ElementsAre(GpibAddress{5, 2}));
  EXPECT_THAT(request.data, ElementsAre('I', 'D', '?'));
  EXPECT_EQ(request.text(), "write of " + toString(GpibAddress{5, 2}));
}

TEST(GpibRequest, ATimeoutIsInSecondsOrMillisecondsAndLimited) {
  const auto expectTimeout = [](std::int32_t timeout, std::int32_t option, Nanoseconds expected) {
    const auto before = Clock::nowNs();
    const auto until =
        requestOf({.timeout = timeout, .cmd = cmdInterfaceClear | option}).until.ns();
    EXPECT_GE(until, before + expected.count());
    EXPECT_LE(until, Clock::nowNs() + expected.count());
  };

  expectTimeout(2, 0, 2s);
  expectTimeout(2, cmdTimeoutMilliseconds, 2ms);
  expectTimeout(0, 0, 3s);
  expectTimeout(-1, 0, 3s);
  expectTimeout(INT32_MAX, 0, 60s);
}

TEST(GpibRequest, AReadIsLimitedByExtraTheBufferAndTheEndOfString) {
  const auto unlimited = requestOf({.cmd = cmdRead, .address = 22});
  EXPECT_EQ(unlimited.limits.maxBytes, 1000U);
  EXPECT_FALSE(unlimited.isCountRequested);
  EXPECT_FALSE(unlimited.limits.endOfString);

  const auto counted = requestOf({.cmd = cmdWriteRead, .address = 22, .extra = 1000});
  EXPECT_EQ(counted.limits.maxBytes, 1000U);
  EXPECT_TRUE(counted.isCountRequested);

  const auto tooLong = requestOf({.cmd = cmdRead, .address = 22, .extra = 1001});
  EXPECT_EQ(tooLong.limits.maxBytes, 1000U);
  EXPECT_FALSE(tooLong.isCountRequested);

  const auto ended =
      requestOf({.cmd = cmdRead, .address = 22, .eomLen = 2, .eomString = {'\r', '\n'}});
  EXPECT_EQ(ended.limits.endOfString, '\n');
}

TEST(GpibRequest, ATriggerHasFurtherAddresses) {
  const auto request =
      requestOf({.cmd = cmdTrigger, .address = 1}, std::string_view("\x02\xff\x03\x04", 4));

  EXPECT_EQ(request.problem, "");
  EXPECT_THAT(request.addresses, ElementsAre(GpibAddress{1}, GpibAddress{2}, GpibAddress{3, 4}));
}

TEST(GpibRequest, OnlyAClearAndAnUnsubscriptionAreForAllInstruments) {
  EXPECT_THAT(requestOf({.cmd = cmdClear, .address = allInstruments}).problem, IsEmpty());
  EXPECT_THAT(requestOf({.cmd = cmdUnsubscribe, .address = allInstruments}).problem, IsEmpty());
  for (const auto command : {cmdRead, cmdWrite, cmdSerialPoll, cmdGoToLocal, cmdSubscribe})
    EXPECT_THAT(requestOf({.cmd = command, .address = allInstruments}).problem,
                HasSubstr("address -1"));
}

TEST(GpibRequest, ALeaseIsLimited) {
  EXPECT_EQ(requestOf({.cmd = cmdLease, .extra = 500}).lease, 500ms);
  EXPECT_EQ(requestOf({.cmd = cmdLease, .extra = INT32_MAX}).lease, 10s);
  EXPECT_THAT(requestOf({.cmd = cmdLease}).problem, HasSubstr("lease of 0 ms"));
}

TEST(GpibRequest, AnInvalidRequestHasAProblem) {
  const auto problemOf = [](const Char8Array& fields, std::string_view value = {}) {
    return requestOf(fields, value).problem;
  };
  EXPECT_THAT(problemOf({}), HasSubstr("cmd 0x0 is not a command"));
  EXPECT_THAT(problemOf({.cmd = cmdUnsubscribe + 1}), HasSubstr("cmd 0x11"));
  EXPECT_THAT(problemOf({.cmd = cmdRead | 0x400}), HasSubstr("cmd 0x401"));
  EXPECT_THAT(problemOf({.cmd = -1}), HasSubstr("cmd 0xffffffff"));
  EXPECT_THAT(problemOf({.cmd = cmdRead | cmdWithoutEnd}), HasSubstr("a read without END"));
  for (const auto address : {-2, 31, 99, 131, 3100, INT32_MAX, INT32_MIN})
    EXPECT_THAT(problemOf({.cmd = cmdRead, .address = address}), HasSubstr("address")) << address;
  EXPECT_THAT(problemOf({.cmd = cmdRead, .extra = -1}), HasSubstr("-1 bytes"));
  EXPECT_THAT(problemOf({.timeout = -5, .cmd = cmdRead}), HasSubstr("timeout -5"));
  EXPECT_THAT(problemOf({.cmd = cmdRead, .eomLen = 100}), HasSubstr("eomLen 100"));
  EXPECT_THAT(problemOf({.cmd = cmdRead, .eomLen = -7}), HasSubstr("eomLen -7"));
  EXPECT_THAT(problemOf({.cmd = cmdSubscribe, .address = 1}, "x"), HasSubstr("value of 1 bytes"));
  EXPECT_THAT(problemOf({.cmd = cmdLease, .extra = 1}, std::string(81, 'x')),
              HasSubstr("name of 81 bytes"));
  EXPECT_THAT(problemOf({.cmd = cmdRemoteEnable, .extra = 2}), HasSubstr("1 (on) or 0 (off)"));
  EXPECT_THAT(problemOf({.cmd = cmdTrigger}, "\x01"), HasSubstr("pairs"));
  EXPECT_THAT(problemOf({.cmd = cmdTrigger}, "\x1f\xff"), HasSubstr("pairs"));
}

}  // namespace
}  // namespace mpf::test
