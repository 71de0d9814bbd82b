// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_controller.h"

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <mpf/drivers/gpib/prologix.h>

#include "tests/drivers/gpib/gpib_test_values.h"
#include "tests/drivers/gpib/prologix_stand.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class PrologixControllerTest : public testing::TestWithParam<PrologixStand::Line> {
 protected:
  PrologixControllerTest() { stand_.plugIn(); }

  void write(const GpibAddress& to, std::string_view text) {
    const auto result = controller_.write(to, raw(text), true, patient());
    EXPECT_TRUE(result.ok()) << result.reason;
  }
  GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits = kUntilEnd) {
    auto result = controller_.read(from, limits, patient());
    EXPECT_TRUE(result.ok()) << result.reason;
    return result;
  }

  PrologixStand stand_{GetParam()};
  PrologixController controller_{stand_.address(), Watchdog::kPatience};
};

INSTANTIATE_TEST_SUITE_P(Lines, PrologixControllerTest, kBothLines, nameOfLine);

TEST_P(PrologixControllerTest, EveryByteValuePassesBothWays) {
  write(kEcho, everyByte());
  const auto answer = read(kEcho);

  EXPECT_EQ(stand_.echo->takeReceived(), everyByte());
  EXPECT_EQ(textOf(answer.data), everyByte());
  EXPECT_TRUE(answer.sawEnd);
}

TEST_P(PrologixControllerTest, EachByteValueMayEndAMessage) {
  for (const char byte : everyByte()) {
    const std::string message{'a', byte};
    write(kEcho, message);
    ASSERT_EQ(textOf(read(kEcho).data), message);
  }
}

TEST_P(PrologixControllerTest, AMebibytePassesBothWays) {
  const auto sent = manyBytes(1 << 20);

  write(kEcho, sent);
  const auto answer = read(kEcho);

  EXPECT_EQ(stand_.echo->ends, 1) << "END with the last piece only";
  EXPECT_TRUE(textOf(answer.data) == sent) << answer.data.size();
}

TEST_P(PrologixControllerTest, AddressesInstrumentsWithSecondaryAddresses) {
  write(kOther, "other");
  write(kEcho, "echo");

  EXPECT_EQ(textOf(read(kOther).data), "other");
  EXPECT_EQ(textOf(read(kEcho).data), "echo");
}

TEST_P(PrologixControllerTest, AWriteWithoutEndIsContinuedByTheNext) {
  EXPECT_TRUE(controller_.write(kEcho, raw("ab"), false, patient()).ok());
  EXPECT_EQ(stand_.echo->ends, 0);
  write(kEcho, "cd");

  EXPECT_EQ(textOf(read(kEcho).data), "abcd");
}

TEST_P(PrologixControllerTest, AnEmptyWriteSucceeds) {
  EXPECT_TRUE(controller_.write(kEcho, {}, true, patient()).ok());
  EXPECT_EQ(stand_.echo->takeReceived(), "");
}

TEST_P(PrologixControllerTest, ReadsUntilTheEndOfString) {
  write(kEcho, "1;2");
  const auto first = read(kEcho, {.maxBytes = 100, .endOfString = ';'});
  const auto second = read(kEcho);

  EXPECT_EQ(textOf(first.data), "1;");
  EXPECT_FALSE(first.sawEnd);
  EXPECT_EQ(textOf(second.data), "2");
  EXPECT_TRUE(second.sawEnd);
}

TEST_P(PrologixControllerTest, AnyByteMayBeTheEndOfString) {
  for (const char byte : everyByte()) {
    const std::string message{byte == 'a' ? 'b' : 'a', byte};
    write(kEcho, message);
    const auto answer =
        read(kEcho, {.maxBytes = 100, .endOfString = static_cast<std::uint8_t>(byte)});
    ASSERT_EQ(textOf(answer.data), message);
    ASSERT_TRUE(answer.sawEnd);
  }
}

// ++read with a character does not end with END, so this takes 3/4 of the time.
TEST_P(PrologixControllerTest, EndEndsAReadThatWaitsForAnEndOfString) {
  withLaterDeadlines([&](Deadline deadline) {
    write(kEcho, "1.5");
    const auto answer = controller_.read(kEcho, {.maxBytes = 100, .endOfString = '\n'}, deadline);
    return answer.ok() && answer.sawEnd && textOf(answer.data) == "1.5";
  });
}

TEST_P(PrologixControllerTest, BytesBeyondTheCountAreForTheNextRead) {
  write(kEcho, "abcdef");

  EXPECT_EQ(textOf(read(kEcho, {.maxBytes = 2}).data), "ab");
  EXPECT_EQ(textOf(read(kEcho, {.maxBytes = 2}).data), "cd");
  const auto last = read(kEcho, {.maxBytes = 2});
  EXPECT_EQ(textOf(last.data), "ef");
  EXPECT_TRUE(last.sawEnd);
}

TEST_P(PrologixControllerTest, AWriteDiscardsTheRestOfTheFormerAnswer) {
  write(kEcho, "abcdef");
  EXPECT_EQ(textOf(read(kEcho, {.maxBytes = 2}).data), "ab");
  write(kEcho, "new");

  EXPECT_EQ(textOf(read(kEcho).data), "new");
}

TEST_P(PrologixControllerTest, AnAnswerWithoutEndTimesOutWithItsBytes) {
  stand_.echo->sendsEnd = false;
  withLaterDeadlines([&](Deadline deadline) {
    write(kEcho, "abc");
    const auto answer = controller_.read(kEcho, kUntilEnd, deadline);
    EXPECT_EQ(answer.status, GpibStatus::timeout);
    return textOf(answer.data) == "abc";
  });
}

TEST_P(PrologixControllerTest, ASilentInstrumentTimesOutAndTheNextOperationWorks) {
  stand_.echo->isSilent = true;
  for (const auto& address : {kEcho, kAbsent}) {
    withLaterDeadlines([&](Deadline deadline) {
      const auto answer = controller_.read(address, kUntilEnd, deadline);
      EXPECT_EQ(answer.status, GpibStatus::timeout);
      return answer.reason.find("address " + toString(address)) != std::string::npos;
    });

    write(kOther, "works");
    EXPECT_EQ(textOf(read(kOther).data), "works");
  }
}

TEST_P(PrologixControllerTest, AnInstrumentThatNeverStopsTimesOutAndTheNextOperationWorks) {
  stand_.echo->neverEnds = true;
  withLaterDeadlines([&](Deadline deadline) {
    const auto answer = controller_.read(kEcho, kUntilEnd, deadline);
    return !answer.data.empty();
  });
  stand_.echo->neverEnds = false;

  write(kOther, "works");

  EXPECT_EQ(textOf(read(kOther).data), "works");
}

TEST_P(PrologixControllerTest, AnInstrumentThatAcceptsNothingDoesNotBlockTheNextOperation) {
  stand_.echo->acceptsBytes = false;
  static_cast<void>(controller_.write(kEcho, raw("ID?"), true, soon()));

  write(kOther, "works");

  EXPECT_EQ(textOf(read(kOther).data), "works");
}

TEST_P(PrologixControllerTest, PollsInstrumentsAndSeesServiceRequests) {
  EXPECT_EQ(controller_.requestsService(patient()), false);
  stand_.other->wantsService = true;

  EXPECT_EQ(controller_.requestsService(patient()), true);
  const auto poll = controller_.serialPoll(kOther, patient());
  EXPECT_TRUE(poll.ok()) << poll.reason;
  EXPECT_EQ(poll.statusByte, 0x41);
  EXPECT_EQ(controller_.requestsService(patient()), false);
  EXPECT_FALSE(controller_.onServiceRequest([] {}));
}

TEST_P(PrologixControllerTest, APollOfAnAbsentInstrumentTimesOut) {
  ASSERT_TRUE(controller_.interfaceClear(patient()).ok());

  const auto poll = controller_.serialPoll(kAbsent, soon());

  EXPECT_EQ(poll.status, GpibStatus::timeout);
}

TEST_P(PrologixControllerTest, ClearsAndTriggersAndSetsControl) {
  using Control = GpibInstrumentModel::Control;
  const std::array both{kEcho, kOther};

  EXPECT_TRUE(controller_.interfaceClear(patient()).ok());
  EXPECT_TRUE(controller_.clear(kEcho, patient()).ok());
  EXPECT_TRUE(controller_.trigger(both, patient()).ok());
  EXPECT_TRUE(controller_.localLockout(patient()).ok());
  EXPECT_EQ(stand_.echo->control, Control::remoteWithLockout);
  EXPECT_TRUE(controller_.goToLocal(kEcho, patient()).ok());

  EXPECT_EQ(stand_.echo->control, Control::local);
  EXPECT_EQ(stand_.echo->clears, 1);
  EXPECT_EQ(stand_.other->clears, 0);
  EXPECT_EQ(stand_.echo->triggers, 1);
  EXPECT_EQ(stand_.other->triggers, 1);
}

TEST_P(PrologixControllerTest, SaysWhatTheHardwareCannotDo) {
  const std::array<GpibAddress, 16> many{};
  for (const auto& result :
       {controller_.sendCommands(raw("\x14"), patient()), controller_.clearAll(patient()),
        controller_.trigger(many, patient()), controller_.remoteEnable(false, patient())}) {
    EXPECT_EQ(result.status, GpibStatus::unsupported);
    EXPECT_THAT(result.reason, HasSubstr(stand_.address()));
  }
}

TEST_P(PrologixControllerTest, SetsRemoteEnableWhereTheVersionCan) {
  EXPECT_TRUE(controller_.remoteEnable(true, patient()).ok());
  stand_.model.behave({.hasRemoteEnable = true});

  EXPECT_TRUE(controller_.remoteEnable(false, patient()).ok());
}

TEST_P(PrologixControllerTest, ShowsTheDataToAPeekHandler) {
  std::vector<GpibPeekedByte> seen;
  controller_.onPeek([&](std::span<const GpibPeekedByte> bytes) {
    seen.insert(seen.end(), bytes.begin(), bytes.end());
  });
  write(kEcho, "ab");
  read(kEcho);

  ASSERT_EQ(seen.size(), 4U);
  EXPECT_EQ(seen[1].value, 'b');
  EXPECT_TRUE(seen[1].endOrIdentify);
  EXPECT_EQ(seen[1].direction, GpibDirection::sent);
  EXPECT_EQ(seen[2].value, 'a');
  EXPECT_FALSE(seen[2].endOrIdentify);
  EXPECT_EQ(seen[2].direction, GpibDirection::received);
  EXPECT_TRUE(seen[3].endOrIdentify);
}

TEST(PrologixController, OpensATerminalLine) {
  PrologixStand stand(PrologixStand::Line::terminal);
  stand.plugIn();
  const auto controller = openPrologix({.address = stand.address()});

  while (!controller->write(kEcho, raw("a"), true, patient()).ok()) continue;

  EXPECT_EQ(stand.echo->takeReceived().back(), 'a');
}

TEST(PrologixController, OpensATcpConnection) {
  const TerminalServer server;

  const auto controller = openPrologix({.address = server.address().toString()});

  EXPECT_TRUE(server.accept());
}

TEST(PrologixController, RefusesAnAddressThatIsNone) {
  EXPECT_THROW(static_cast<void>(openPrologix({.address = "gpib1"})), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
