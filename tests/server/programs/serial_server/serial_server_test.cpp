// SPDX-License-Identifier: MIT
// A serial server on a real pseudo-terminal with an instrument at its far end, used through shared
// memory.
#include <future>

#include <mpf/serial_commands.h>

#include "tests/server/programs/serial_server/serial_fixture.h"

namespace mpf::test {
namespace {

using namespace serial;

TEST_F(SerialServerTest, AQueryReturnsTheAnswerWithItsTerminator) {
  start();

  const auto reply = ask("ECHO hello\n", fieldsOf(cmdWriteRead | cmdFlush));

  EXPECT_EQ(reply.status, serialServerStatusOK);
  EXPECT_EQ(reply.text, "hello\r\n");
}

TEST_F(SerialServerTest, ATimeoutInWholeSecondsIsAcceptedToo) {
  start();

  const auto reply = ask("ECHO hello\n", {.timeout = 60, .cmd = cmdWriteRead});

  EXPECT_EQ(reply.status, serialServerStatusOK);
}

TEST_F(SerialServerTest, AMissingAnswerIsATimeout) {
  start();
  instrument_.behave({.isSilent = true});

  const auto reply = ask("ECHO hello\n", fieldsOf(cmdWriteRead, 20));

  EXPECT_EQ(reply.status, serialServerStatusTimeout);
  EXPECT_EQ(reply.text, "");
}

TEST_F(SerialServerTest, AReplyAfterATimeoutHasTheBytesThatWereRead) {
  start();
  instrument_.behave({.answerEnd = ""});

  SerialReply reply{};
  for (int timeoutMs = 200; reply.text.empty(); timeoutMs *= 2)  // again if the answer was too late
    reply = ask("ECHO half\n", fieldsOf(cmdWriteRead, timeoutMs));

  EXPECT_EQ(reply.status, serialServerStatusTimeout);
  EXPECT_EQ(reply.text, "half");
}

TEST_F(SerialServerTest, PartsOfAnAnswerAreJoined) {
  start();
  instrument_.behave({.gap = 1ms});

  EXPECT_EQ(ask("ECHO one by one\n", fieldsOf(cmdWriteRead)).text, "one by one\r\n");
}

TEST_F(SerialServerTest, ExtraLimitsTheBytesOfARead) {
  start({.bufferBytes = 100, .eom = "", .circularBuffer = false});
  auto fields = fieldsOf(cmdWriteRead);
  fields.extra = 4;

  const auto reply = ask("ECHO binary\n", fields);

  EXPECT_EQ(reply.status, serialServerStatusOK);
  EXPECT_EQ(reply.text, "bina");
}

TEST_F(SerialServerTest, AnAnswerLongerThanTheBufferOverflows) {
  start({.bufferBytes = 5, .eom = "\r\n", .circularBuffer = false});

  const auto reply = ask("ECHO much too long\n", fieldsOf(cmdWriteRead));

  EXPECT_EQ(reply.status, serialServerStatusOverflow);
  EXPECT_EQ(reply.text, "much ");
}

TEST_F(SerialServerTest, NoByteIsLostAfterAnAnswerThatOverflows) {
  start({.bufferBytes = 5, .eom = "\r\n", .circularBuffer = true});

  EXPECT_EQ(ask("ECHO much too\n", fieldsOf(cmdWriteRead)),
            (Reply{serialServerStatusOverflow, "much "}));
  EXPECT_EQ(ask("", fieldsOf(cmdRead)), (Reply{serialServerStatusOK, "too\r\n"}));
}

TEST_F(SerialServerTest, ANewTerminatorAppliesToLaterRequests) {
  start();
  auto fields = fieldsOf(cmdWriteRead | cmdSetEom);
  fields.eomLen = 1;
  fields.eomString = {'l'};

  EXPECT_EQ(ask("ECHO hello\n", fields).text, "hel");
  EXPECT_EQ(ask("ECHO hello\n", fieldsOf(cmdWriteRead | cmdFlush)).text, "hel");
}

TEST_F(SerialServerTest, ATerminatorLengthOutOfRangeIsTolerated) {
  start();
  auto fields = fieldsOf(cmdWriteRead | cmdSetEom);
  fields.eomLen = 3;
  fields.eomString = {'\r', '\n'};

  EXPECT_EQ(ask("ECHO hello\n", fields).text, "hello\r\n");
}

TEST_F(SerialServerTest, CircularModeKeepsLinesForLaterReads) {
  start();
  ASSERT_EQ(ask("", fieldsOf(cmdRead | cmdStartCircularBuffer, 0)).status,
            serialServerStatusTimeout);

  ASSERT_EQ(ask("ECHO first\nECHO second\n", fieldsOf(cmdWrite)).status, serialServerStatusOK);

  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "first\r\n");
  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "second\r\n");
}

TEST_F(SerialServerTest, RetriesUntilTheInstrumentAnswers) {
  start();
  instrument_.behave({.delay = 30ms});
  auto fields = fieldsOf(cmdWriteRead, 20);
  fields.numberRetrys = 1000;

  const auto reply = ask("ECHO late\n", fields);

  EXPECT_EQ(reply.status, serialServerStatusOK);
  EXPECT_EQ(reply.text, "late\r\n");
}

// A read that is repeated until its answer is there.
class RepeatedReadTest : public SerialServerTest {
 protected:
  void read(std::size_t bufferBytes) {
    start({.bufferBytes = bufferBytes,
           .eom = "\r\n",
           .circularBuffer = true,
           .limits = {.maxTimeout = 24h, .maxRetries = 1'000'000}});
    reply_ = std::async(std::launch::async, [this] {
      auto fields = fieldsOf(cmdRead, 20);
      fields.numberRetrys = 1'000'000;
      return ask("", fields);
    });
    waitForTimeout();
  }
  void waitForTimeout() {
    const auto before = port_.counters().timeouts;
    while (port_.counters().timeouts == before) std::this_thread::yield();
  }
  std::future<SerialReply> reply_;
};

TEST_F(RepeatedReadTest, ReturnsAnAnswerInPiecesAsAWhole) {
  read(100);
  instrument_.say("VOLT=-12");
  while (port_.counters().bytesIn < 8) std::this_thread::yield();
  waitForTimeout();

  instrument_.say("3.4\r\n");

  EXPECT_EQ(reply_.get(), (SerialReply{serialServerStatusOK, "VOLT=-123.4\r\n"}));
}

// The rest with status 0 would look like an answer.
TEST_F(RepeatedReadTest, DoesNotReturnTheRestOfAnAnswerThatIsTooLong) {
  read(4);

  instrument_.say("12345\r\n");

  EXPECT_EQ(reply_.get().status, serialServerStatusOverflow);
}

TEST_F(SerialServerTest, AFlushBeforeAWriteDropsWhatWasReceived) {
  start();
  ASSERT_EQ(ask("ECHO old\n", fieldsOf(cmdWrite)).status, serialServerStatusOK);
  while (port_.counters().bytesIn < 5) std::this_thread::yield();

  ASSERT_EQ(ask("ECHO new\n", fieldsOf(cmdWrite | cmdFlush)).status, serialServerStatusOK);

  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "new\r\n");
}

TEST_F(SerialServerTest, AnUnpluggedLineIsAnErrorAndWorksAgainLater) {
  start();
  instrument_.unplug();
  ASSERT_TRUE(port_.waitForState(SerialPortState::unplugged, Deadline::never()));
  EXPECT_EQ(ask("ECHO hello\n", fieldsOf(cmdWriteRead)).status, serialServerStatusError);

  instrument_.plugIn();
  ASSERT_TRUE(port_.waitForState(SerialPortState::plugged, Deadline::never()));

  EXPECT_EQ(ask("ECHO hello\n", fieldsOf(cmdWriteRead)).text, "hello\r\n");
}

TEST_F(SerialServerTest, AnInvalidCommandIsAnError) {
  start();

  EXPECT_EQ(ask("", fieldsOf(cmdFlush)).status, serialServerStatusError);
}

TEST_F(SerialServerTest, ARefusedRequestHasNoEffect) {
  start();
  for (const auto cmd : {cmdSetEom, cmdSetEom | cmdRead | 0x20000, 0x20000 | cmdRead}) {
    auto fields = fieldsOf(cmd);
    fields.eomLen = 1;
    fields.eomString = {';'};
    EXPECT_EQ(ask("", fields).status, serialServerStatusError) << cmd;
  }

  EXPECT_EQ(ask("ECHO a;b\n", fieldsOf(cmdWriteRead)).text, "a;b\r\n");
}

TEST_F(SerialServerTest, TheReplyToSettingsIsAnInt32) {
  start();

  auto accepted = client_.call(SerialConfigMessage({.baud = 19200}), 60s);
  auto refused = client_.call(SerialConfigMessage({.stopBits = 7}), 60s);

  ASSERT_NE(accepted.message().tryAs<Int32>(), nullptr);
  EXPECT_EQ(accepted.message().tryAs<Int32>()->status, 0);
  EXPECT_EQ(refused.message().tryAs<Int32>()->status, serialServerStatusError);
}

TEST_F(SerialServerTest, RequestsOfOtherTypesGetAStatus) {
  start();

  auto number = client_.call(Float64Message(), 60s);
  auto array = client_.call(Float64ArrayMessage::allocValue(1), 60s);

  ASSERT_NE(number.message().tryAs<Float64>(), nullptr);
  EXPECT_EQ(number.message().tryAs<Float64>()->status, -1);
  ASSERT_NE(array.message().tryAs<Float64Array>(), nullptr);
  EXPECT_EQ(array.message().tryAs<Float64Array>()->status, -1);
}

}  // namespace
}  // namespace mpf::test
