// SPDX-License-Identifier: MIT
// One channel of the simulated chip, as the data sheet says.
#include "drivers/octal_uart/octal_uart_model_channel.h"

#include <gtest/gtest.h>
#include <string_view>

#include "drivers/octal_uart/scc2698b.h"

namespace mpf::test {
namespace {

using namespace scc2698b;

class OctalUartModelChannelTest : public testing::Test {
 protected:
  static constexpr SerialSettings kUsual{9600, 1, 8, 'N', 'N'};

  // Sets up the channel and enables both directions.
  void setUp(const SerialSettings& settings = kUsual) {
    const auto mode = octalUartModeOf(settings);
    channel_.writeCr(kCrResetMr);
    channel_.writeMr(mode.mr1);
    channel_.writeMr(mode.mr2);
    channel_.writeCsr(mode.csr);
    channel_.writeCr(kCrEnableRx | kCrEnableTx);
  }
  void farEndSends(std::string_view text, LineFault fault = LineFault::none) {
    for (const char byte : text)
      channel_.incoming.push_back({static_cast<std::uint8_t>(byte), fault});
  }
  void runUntil(std::int64_t ns) { channel_.runUntil(ns, true, false); }
  void runInstantly() { channel_.runUntil(0, false, false); }
  std::string readAll() {
    std::string text;
    while ((channel_.readSr() & kSrRxRdy) != 0) text += static_cast<char>(channel_.readRhr());
    return text;
  }

  OctalUartModelChannel channel_;
  const std::int64_t byteNs_ = byteTime(kUsual).count();
};

TEST_F(OctalUartModelChannelTest, NeitherSendsNorReceivesUntilItIsEnabled) {
  channel_.writeThr('a');
  farEndSends("b");
  runInstantly();

  EXPECT_EQ(channel_.readSr(), 0);
  EXPECT_EQ(channel_.outgoing, "");
  EXPECT_EQ(channel_.unheard(), 1U);
}

TEST_F(OctalUartModelChannelTest, SendsInTheTimeOfTheBaudRate) {
  setUp();
  EXPECT_EQ(channel_.nextEventNs(), INT64_MAX);
  channel_.writeThr('a');
  runUntil(0);
  channel_.writeThr('b');
  channel_.writeThr('c');  // lost: the holding register is occupied
  EXPECT_EQ(channel_.nextEventNs(), byteNs_);
  runUntil(byteNs_ - 1);
  EXPECT_EQ(channel_.outgoing, "");
  EXPECT_EQ(channel_.readSr(), 0);

  runUntil(byteNs_);
  EXPECT_EQ(channel_.outgoing, "a");
  EXPECT_EQ(channel_.readSr(), kSrTxRdy);
  runUntil(2 * byteNs_);
  EXPECT_EQ(channel_.outgoing, "ab");
  EXPECT_EQ(channel_.readSr(), kSrTxRdy | kSrTxEmt);
  EXPECT_EQ(channel_.nextEventNs(), INT64_MAX);
}

TEST_F(OctalUartModelChannelTest, ReceivesInTheTimeOfTheBaudRate) {
  setUp();
  farEndSends("ab");
  runUntil(0);
  EXPECT_EQ(channel_.nextEventNs(), byteNs_);
  runUntil(byteNs_ - 1);
  EXPECT_EQ(readAll(), "");
  runUntil(byteNs_);
  EXPECT_EQ(readAll(), "a");
  runUntil(2 * byteNs_);
  EXPECT_EQ(readAll(), "b");
  EXPECT_EQ(channel_.nextEventNs(), INT64_MAX);
}

TEST_F(OctalUartModelChannelTest, MayReceiveLateBytesOneAfterTheOther) {
  setUp();
  farEndSends("abcd");
  channel_.runUntil(0, true, true);

  channel_.runUntil(10 * byteNs_, true, true);

  EXPECT_EQ(readAll(), "ab") << "without a lag of more than one byte";
  EXPECT_EQ(channel_.nextEventNs(), 11 * byteNs_);
  runUntil(20 * byteNs_);
  EXPECT_EQ(readAll(), "cd") << "all at once";
}

TEST_F(OctalUartModelChannelTest, LosesBytesWhenTheFifoAndTheShiftRegisterAreFull) {
  setUp();
  farEndSends("abcdefg");
  runUntil(0);
  runUntil(6 * byteNs_);

  EXPECT_EQ(channel_.overrun(), 2U);
  EXPECT_EQ(channel_.readSr() & (kSrFfull | kSrOverrun), kSrFfull | kSrOverrun);
  channel_.writeCr(kCrResetErrors);
  EXPECT_EQ(channel_.readSr() & kSrOverrun, 0);
  EXPECT_EQ(readAll(), "abcf");
  EXPECT_EQ(channel_.readRhr(), 0) << "empty";
}

TEST_F(OctalUartModelChannelTest, LosesNoByteThatTakesNoTime) {
  setUp();
  farEndSends("abcdefg");
  std::string text;
  for (int i = 0; i < 7; ++i) {
    runInstantly();
    text += static_cast<char>(channel_.readRhr());
  }

  EXPECT_EQ(text, "abcdefg");
  EXPECT_EQ(channel_.overrun(), 0U);
}

TEST_F(OctalUartModelChannelTest, StopsTheFarEndWithRtsWhileTheFifoIsFull) {
  setUp({9600, 1, 8, 'N', 'H'});
  EXPECT_FALSE(channel_.requestsToSend()) << "RTS is not asserted";
  channel_.writeCr(kCrAssertRts);
  farEndSends("abcdef");
  runUntil(0);
  runUntil(10 * byteNs_);
  EXPECT_TRUE((channel_.readSr() & kSrFfull) != 0);
  EXPECT_FALSE(channel_.requestsToSend());
  runUntil(20 * byteNs_);
  EXPECT_EQ(channel_.nextEventNs(), INT64_MAX);
  static_cast<void>(readAll());

  EXPECT_TRUE(channel_.requestsToSend());
  channel_.writeCr(kCrNegateRts);
  EXPECT_FALSE(channel_.requestsToSend());
}

TEST_F(OctalUartModelChannelTest, SendsWithCtsOnlyWhenFlowControlIsSet) {
  channel_.setClearToSend(false);
  setUp();
  channel_.writeThr('a');
  runInstantly();
  EXPECT_EQ(channel_.outgoing, "a");
  setUp({9600, 1, 8, 'N', 'H'});
  channel_.writeThr('b');
  runInstantly();
  EXPECT_EQ(channel_.outgoing, "a");

  channel_.setClearToSend(true);
  runInstantly();

  EXPECT_EQ(channel_.outgoing, "ab");
}

TEST_F(OctalUartModelChannelTest, HasCharactersOfTheGivenSize) {
  setUp({9600, 1, 5, 'E', 'N'});
  EXPECT_EQ(channel_.settings(), (SerialSettings{9600, 1, 5, 'E', 'N'}));
  channel_.writeThr(0xff);
  farEndSends("\xff");
  runInstantly();

  EXPECT_EQ(channel_.outgoing, "\x1f");
  EXPECT_EQ(channel_.readRhr(), 0x1f);
}

TEST_F(OctalUartModelChannelTest, ReportsTheErrorsOfTheByteThatIsReadNext) {
  setUp();
  farEndSends("a", LineFault::parity);
  farEndSends("b", LineFault::framing);
  farEndSends(std::string_view("\0", 1), LineFault::breakSignal);
  runInstantly();

  EXPECT_EQ(channel_.readSr() & kSrErrors, kSrParity);
  EXPECT_EQ(channel_.readRhr(), 'a');
  EXPECT_EQ(channel_.readSr() & kSrErrors, kSrFraming);
  channel_.writeCr(kCrResetErrors);
  EXPECT_EQ(channel_.readSr() & kSrErrors, 0);
  EXPECT_EQ(channel_.readRhr(), 'b');
  EXPECT_EQ(channel_.readSr() & kSrErrors, kSrBreak);
  EXPECT_EQ(channel_.isr() & kIsrBreakChange, kIsrBreakChange);
  channel_.writeCr(kCrResetBreakChange);
  EXPECT_EQ(channel_.isr() & kIsrBreakChange, 0);
}

TEST_F(OctalUartModelChannelTest, SendsNothingDuringABreak) {
  channel_.writeCr(kCrStartBreak);
  EXPECT_FALSE(channel_.isBreaking()) << "the transmitter is disabled";
  setUp();
  channel_.writeCr(kCrStartBreak);
  channel_.writeCr(kCrStartBreak);
  channel_.writeThr('a');
  runInstantly();
  EXPECT_TRUE(channel_.isBreaking());
  EXPECT_EQ(channel_.breaks(), 1);
  EXPECT_EQ(channel_.outgoing, "");

  channel_.writeCr(kCrStopBreak);
  runInstantly();

  EXPECT_FALSE(channel_.isBreaking());
  EXPECT_EQ(channel_.outgoing, "a");
}

TEST_F(OctalUartModelChannelTest, RequestsInterruptsForReceivedBytesAndForRoom) {
  setUp();
  EXPECT_EQ(channel_.isr(), kIsrTxRdy);
  farEndSends("ab");
  runInstantly();
  EXPECT_EQ(channel_.isr(), kIsrTxRdy | kIsrRxRdy);
  channel_.writeCr(kCrResetMr);
  channel_.writeMr(kMr1RxIntFull | kMr1NoParity | 3);
  EXPECT_EQ(channel_.isr(), kIsrTxRdy) << "the FIFO is not full";

  farEndSends("c");
  runInstantly();
  channel_.writeCr(kCrDisableTx);

  EXPECT_EQ(channel_.isr(), kIsrRxRdy);
}

TEST_F(OctalUartModelChannelTest, LosesItsBytesWhenItIsReset) {
  setUp();
  farEndSends("ab");
  channel_.writeThr('c');
  runUntil(0);
  runUntil(byteNs_ - 1);
  channel_.writeCr(kCrResetTx);
  runUntil(3 * byteNs_);
  EXPECT_EQ(channel_.outgoing, "");
  channel_.writeCr(kCrResetRx);

  EXPECT_EQ(channel_.readSr(), 0);
}

}  // namespace
}  // namespace mpf::test
