// SPDX-License-Identifier: MIT
// LineReader, with this thread as the port and the server.
#include "server/programs/serial_server/line_reader.h"

#include <gtest/gtest.h>
#include <string_view>

#include "server/programs/serial_server/line_faults.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kBufferBytes = 6;
constexpr LineLimits kNoSilence{.settleTime = 0ms, .quietTime = 0ms};

class LineReaderTest : public testing::Test {
 protected:
  // Receives `bytes`. Returns the result of the last one.
  ByteHandlerResult receive(std::string_view bytes) {
    auto result = ByteHandlerResult::ok;
    for (const char byte : bytes) {
      EXPECT_EQ(result, ByteHandlerResult::ok) << "before the last byte";
      result = reader_.byteReceived(static_cast<std::uint8_t>(byte));
    }
    return result;
  }
  // Begins a read, as the port does.
  ByteHandlerResult beginRead(bool flush = false, std::size_t maxBytes = 0,
                              bool mayBeLate = false) {
    reader_.prepareRead(flush, maxBytes, mayBeLate);
    return reader_.readBegins();
  }
  // Begins a write-read and sends its question, as the port does.
  void ask(bool mayBeLate = false) {
    reader_.prepareQuestion(0, mayBeLate);
    EXPECT_EQ(waitUntilSynchronized(), LineReader::Sync::synchronized);
    EXPECT_EQ(reader_.readBegins(), ByteHandlerResult::ok);
    reader_.sendBegins();
  }
  LineReader::Sync waitUntilSynchronized() {
    return reader_.waitUntilSynchronized(true, Deadline::never(), [] { return false; });
  }
  LineReader::Answer end(SerialPortStatus status = SerialPortStatus::success) {
    reader_.readEnds(status);
    return reader_.takeAnswer();
  }

  int surplus_ = 0;
  int faults_ = 0;
  LineReader reader_{kBufferBytes,         "\r", true, kNoSilence, [this] { ++surplus_; },
                     [this] { ++faults_; }};
};

TEST_F(LineReaderTest, AnAnswerEndsWithTheEndOfMessage) {
  EXPECT_EQ(beginRead(), ByteHandlerResult::ok);

  EXPECT_EQ(receive("ab"), ByteHandlerResult::ok);
  EXPECT_EQ(receive("\r"), ByteHandlerResult::endRead);

  const auto answer = end();
  EXPECT_EQ(answer.bytes, "ab\r");
  EXPECT_FALSE(answer.overflow);
  EXPECT_FALSE(answer.wasDisturbed);
  EXPECT_EQ(answer.faults, 0);
}

TEST_F(LineReaderTest, ANewEndOfMessageAppliesToTheNextRead) {
  reader_.setEom("\n\r");
  beginRead();

  EXPECT_EQ(receive("a\r\n"), ByteHandlerResult::ok);
  EXPECT_EQ(receive("\r"), ByteHandlerResult::endRead);

  EXPECT_EQ(end().bytes, "a\r\n\r");
}

TEST_F(LineReaderTest, ATimeoutReturnsTheBytesThatWereRead) {
  beginRead();
  receive("ab");

  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "ab");
  beginRead();
  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "") << "they are returned once";
}

TEST_F(LineReaderTest, TheCircularBufferKeepsAnswersForLaterReads) {
  receive("a\rb\r");

  EXPECT_EQ(beginRead(), ByteHandlerResult::endRead);
  EXPECT_EQ(end().bytes, "a\r");
  EXPECT_EQ(beginRead(), ByteHandlerResult::endRead);
  EXPECT_EQ(end().bytes, "b\r");
  EXPECT_EQ(surplus_, 0);
}

TEST_F(LineReaderTest, AFullCircularBufferDropsItsOldestBytes) {
  receive("abcdefgh");

  beginRead();

  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "cdefgh");
}

TEST_F(LineReaderTest, AFullCircularBufferKeepsTheMarksOfItsBytes) {
  receive(std::string(100, 'x'));
  reader_.lineFailed(LineFault::overrun, 1);
  receive("a\rbc\rd");

  EXPECT_EQ(beginRead(), ByteHandlerResult::endRead);
  const auto damaged = end();
  EXPECT_EQ(beginRead(), ByteHandlerResult::endRead);
  const auto sound = end();

  EXPECT_EQ(damaged.bytes, "a\r");
  EXPECT_EQ(damaged.faults, faultBit(LineFault::overrun));
  EXPECT_EQ(sound.bytes, "bc\r");
  EXPECT_EQ(sound.faults, 0);
}

TEST_F(LineReaderTest, AFlushDropsTheBytesBeforeTheRead) {
  receive("a\r");

  EXPECT_EQ(beginRead(true), ByteHandlerResult::ok);
  receive("b\r");

  EXPECT_EQ(end().bytes, "b\r");
}

TEST_F(LineReaderTest, WithoutCircularBufferBytesBetweenReadsAreDropped) {
  reader_.setCircular(false);

  receive("a\rb");

  EXPECT_EQ(beginRead(), ByteHandlerResult::ok);
  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "");
}

TEST_F(LineReaderTest, ALimitEndsAnAnswerThatHasNoEndBeforeIt) {
  beginRead(false, 3);
  EXPECT_EQ(receive("abc"), ByteHandlerResult::endRead);
  EXPECT_EQ(end().bytes, "abc");

  beginRead(false, 3);
  EXPECT_EQ(receive("a\r"), ByteHandlerResult::endRead);
  EXPECT_EQ(end().bytes, "a\r");
}

TEST_F(LineReaderTest, TheByteAfterAnOverflowBeginsTheNextAnswer) {
  beginRead();
  EXPECT_EQ(receive("abcdefg"), ByteHandlerResult::endRead);
  const auto answer = end();
  EXPECT_TRUE(answer.overflow);
  EXPECT_EQ(answer.bytes, "abcdef");

  beginRead();
  receive("\r");

  EXPECT_EQ(end().bytes, "g\r");
}

TEST_F(LineReaderTest, AWriteReadDropsEarlierInput) {
  receive("old\r");

  ask();
  EXPECT_EQ(receive("new\r"), ByteHandlerResult::endRead);

  EXPECT_EQ(end().bytes, "new\r");
}

TEST_F(LineReaderTest, InputThatNoRequestReadsIsReportedOnceAfterEachWriteRead) {
  receive("before any write-read\r");
  EXPECT_EQ(surplus_, 0);
  for (int asked = 1; asked <= 2; ++asked) {
    ask();
    receive("a\r");
    end();
    EXPECT_EQ(surplus_, asked - 1);

    receive("b\r");
    EXPECT_EQ(waitUntilSynchronized(), LineReader::Sync::synchronized);
    receive("c\r");

    EXPECT_EQ(surplus_, asked);
  }
}

TEST_F(LineReaderTest, InputBeforeTheFirstByteStopsAWriteRead) {
  reader_.prepareQuestion(0, false);
  ASSERT_EQ(waitUntilSynchronized(), LineReader::Sync::synchronized);
  ASSERT_EQ(reader_.readBegins(), ByteHandlerResult::ok);

  EXPECT_EQ(receive("x"), ByteHandlerResult::error);

  const auto answer = end(SerialPortStatus::failure);
  EXPECT_TRUE(answer.wasDisturbed);
  EXPECT_EQ(answer.bytes, "");
}

TEST_F(LineReaderTest, ALateAnswerCanBeContinued) {
  ask(true);
  receive("A1");
  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "A1");
  receive("7\r");

  ASSERT_TRUE(reader_.tryContinue(false));
  EXPECT_EQ(reader_.readBegins(), ByteHandlerResult::endRead);

  EXPECT_EQ(end().bytes, "A17\r");
}

TEST_F(LineReaderTest, ALateAnswerIsNotContinuedWithoutPermissionOrWithoutAnEnd) {
  ask(false);
  end(SerialPortStatus::timeout);
  EXPECT_FALSE(reader_.tryContinue(false));

  reader_.setEom("");
  reader_.prepareQuestion(0, true);
  reader_.sendBegins();
  end(SerialPortStatus::timeout);
  EXPECT_FALSE(reader_.tryContinue(false));
}

TEST_F(LineReaderTest, TheNextRequestDropsALateAnswer) {
  ask(true);
  receive("A1");
  end(SerialPortStatus::timeout);

  EXPECT_EQ(beginRead(), ByteHandlerResult::ok);
  receive("b\r");

  EXPECT_EQ(end().bytes, "b\r");
}

TEST_F(LineReaderTest, AReadThatTimedOutCanBeContinuedRepeatedly) {
  beginRead(false, 0, true);
  receive("a");
  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "a");
  receive("b");
  ASSERT_TRUE(reader_.tryContinue(true));
  EXPECT_EQ(reader_.readBegins(), ByteHandlerResult::ok);
  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "ab");
  receive("c\rd\r");
  ASSERT_TRUE(reader_.tryContinue(false));

  EXPECT_EQ(reader_.readBegins(), ByteHandlerResult::endRead);

  EXPECT_EQ(end().bytes, "abc\r");
  EXPECT_EQ(beginRead(), ByteHandlerResult::endRead);
  EXPECT_EQ(end().bytes, "d\r");
}

// Before the next attempt of the read, or while it begins.
TEST_F(LineReaderTest, ALateAnswerToAReadThatIsTooLongOverflows) {
  for (const bool isEarly : {true, false}) {
    beginRead(false, 0, true);
    EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "");
    if (isEarly) receive("123456789\r");
    ASSERT_TRUE(reader_.tryContinue(false));
    if (!isEarly) receive("123456789\r");

    EXPECT_EQ(reader_.readBegins(), ByteHandlerResult::endRead);

    EXPECT_TRUE(end().overflow);
  }
}

TEST_F(LineReaderTest, TheNextRequestReadsWhatFollowsAReadThatTimedOut) {
  beginRead(false, 0, true);
  receive("abcdef");
  EXPECT_EQ(end(SerialPortStatus::timeout).bytes, "abcdef");
  receive("g\r");

  EXPECT_EQ(beginRead(), ByteHandlerResult::endRead);

  EXPECT_EQ(end().bytes, "g\r");
}

TEST_F(LineReaderTest, AFaultDuringAReadMarksItsAnswer) {
  beginRead();
  receive("a");
  reader_.lineFailed(LineFault::overrun, 1);
  receive("b\r");

  const auto answer = end();

  EXPECT_EQ(answer.faults, faultBit(LineFault::overrun));
  EXPECT_EQ(faults_, 1);
  beginRead();
  receive("c\r");
  EXPECT_EQ(end().faults, 0);
}

TEST_F(LineReaderTest, ALostLineBetweenAnswersDamagesNone) {
  receive("a\r");
  reader_.lineFailed(LineFault::unplugged, 1);
  beginRead();

  EXPECT_EQ(end().faults, 0);
  EXPECT_EQ(faults_, 1);
}

TEST_F(LineReaderTest, ALostLineWithinAnAnswerDamagesIt) {
  receive("a");
  reader_.lineFailed(LineFault::unplugged, 1);
  beginRead();
  receive("b\r");

  EXPECT_EQ(end().faults, faultBit(LineFault::unplugged));
}

TEST(LineReaderSync, WaitsForSilenceUntilItsDeadlineOrTheEndOfItsClient) {
  LineReader reader(kBufferBytes, "\r", true, {.settleTime = 1h, .quietTime = 1h});
  reader.byteReceived('x');

  EXPECT_EQ(reader.waitUntilSynchronized(false, Deadline::never(), [] { return true; }),
            LineReader::Sync::synchronized)
      << "a plain write needs no silence";
  reader.prepareQuestion(0, false);
  EXPECT_EQ(reader.waitUntilSynchronized(true, Deadline::atNs(0), [] { return false; }),
            LineReader::Sync::noSilence);
  EXPECT_EQ(reader.waitUntilSynchronized(true, Deadline::never(), [] { return true; }),
            LineReader::Sync::abandoned);
}

}  // namespace
}  // namespace mpf::test
