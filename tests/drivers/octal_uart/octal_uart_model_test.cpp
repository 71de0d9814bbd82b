// SPDX-License-Identifier: MIT
// The model behaves as the data sheet says. The tests of the driver would not find its errors.
#include "drivers/octal_uart/octal_uart_model.h"

#include <fcntl.h>
#include <unistd.h>

#include "octal_uart_fixture.h"

namespace mpf::test {
namespace {

using namespace scc2698b;

constexpr int kChannel = 2;  // channel a of block 1

class OctalUartModelTest : public OctalUartTest {
 protected:
  Registers& io() { return carrier_.site(0).io(); }
  std::uint8_t get(ChannelRegister which) { return io().read8(at(kChannel, which)); }
  void set(ChannelRegister which, unsigned value) {
    io().write8(at(kChannel, which), static_cast<std::uint8_t>(value));
  }
  void setUp(unsigned mr2 = kMr2OneStop) {
    set(kCr, kCrResetMr);
    set(kMr, 0x13);
    set(kMr, mr2);
    set(kCsr, 0xbb);
    set(kCr, kCrEnableRx | kCrEnableTx);
  }
  std::chrono::nanoseconds byte() { return byteTime({9600, 1, 8, 'N', 'N'}); }
};

TEST_F(OctalUartModelTest, Mr1IsAccessedOnceAfterItsPointerWasReset) {
  plug({});

  setUp();

  EXPECT_EQ(get(kMr), kMr2OneStop);
  EXPECT_EQ(get(kMr), kMr2OneStop);
  set(kCr, kCrResetMr);
  EXPECT_EQ(get(kMr), 0x13);
  EXPECT_EQ(get(kMr), kMr2OneStop);
}

TEST_F(OctalUartModelTest, HoldsThreeBytesAndOneInItsShiftRegister) {
  auto& model = plug({.time = OctalUartModelTime::stepped});
  setUp();
  model.farEndSend(kChannel, "abcdef");
  model.advance({});

  model.advance(4 * byte());

  EXPECT_EQ(get(kSr) & ~(kSrTxRdy | kSrTxEmt), kSrRxRdy | kSrFfull);
  model.advance(byte());
  EXPECT_EQ(get(kSr) & kSrOverrun, kSrOverrun);
  std::string read;
  while ((get(kSr) & kSrRxRdy) != 0) read += static_cast<char>(get(kRhr));
  EXPECT_EQ(read, "abce");
  EXPECT_EQ(model.with(kChannel, [](const auto& channel) { return channel.overrun(); }), 1U);
  set(kCr, kCrResetErrors);
  EXPECT_EQ(get(kSr) & kSrErrors, 0);
}

TEST_F(OctalUartModelTest, ReportsErrorsWithTheirByte) {
  auto& model = plug({});
  setUp();
  model.farEndSend(kChannel, "a");
  model.farEndSend(kChannel, "b", LineFault::parity);
  model.farEndSend(kChannel, "c", LineFault::framing);
  model.farEndSend(kChannel, std::string(1, '\0'), LineFault::breakSignal);

  for (const unsigned error : {0U, unsigned{kSrParity}, unsigned{kSrFraming}, unsigned{kSrBreak}}) {
    EXPECT_EQ(get(kSr) & kSrErrors, error);
    static_cast<void>(get(kRhr));
  }
}

TEST_F(OctalUartModelTest, SendsOneByteWhileTheNextOneIsStored) {
  auto& model = plug({.time = OctalUartModelTime::stepped});
  setUp();

  EXPECT_EQ(get(kSr), kSrTxRdy | kSrTxEmt);
  set(kThr, 'a');
  EXPECT_EQ(get(kSr), kSrTxRdy);
  set(kThr, 'b');
  EXPECT_EQ(get(kSr), 0);

  model.advance(byte());
  EXPECT_EQ(get(kSr), kSrTxRdy);
  EXPECT_EQ(model.farEndReceived(kChannel), "a");
  model.advance(byte());
  EXPECT_EQ(get(kSr), kSrTxRdy | kSrTxEmt);
  EXPECT_EQ(model.farEndReceived(kChannel), "ab");
}

// The Philips data sheets of this family: "enable transmitter and reset transmitter" cannot be in
// one command word.
TEST_F(OctalUartModelTest, IsNotEnabledByTheWriteThatResetsIt) {
  auto& model = plug({});
  setUp();

  set(kCr, kCrResetTx | kCrEnableTx);
  set(kCr, kCrResetRx | kCrEnableRx);
  set(kThr, 'x');
  model.farEndSend(kChannel, "y");

  EXPECT_EQ(get(kSr), 0);
  EXPECT_EQ(model.farEndReceived(kChannel), "");
  set(kCr, kCrEnableTx | kCrEnableRx);
  EXPECT_EQ(get(kSr), kSrTxRdy | kSrTxEmt);
}

TEST_F(OctalUartModelTest, ReceivesItsOwnBytesInLocalLoopback) {
  auto& model = plug({});
  setUp(kMr2OneStop | kMr2LocalLoopback);
  set(kCr, kCrDisableRx);

  set(kThr, 'x');

  EXPECT_EQ(get(kSr) & kSrRxRdy, kSrRxRdy);
  EXPECT_EQ(get(kRhr), 'x');
  EXPECT_EQ(model.farEndReceived(kChannel), "");
}

TEST_F(OctalUartModelTest, InterruptsForUnmaskedBitsOnly) {
  auto& model = plug({});
  auto& interrupt = carrier_.site(0).interrupt(0);
  interrupt.enable();
  setUp();
  EXPECT_EQ(interrupt.take(), 0U);

  io().write8(atBlock(1, kImr), kIsrRxRdy);
  EXPECT_EQ(interrupt.take(), 0U);
  model.farEndSend(kChannel, "a");
  EXPECT_EQ(interrupt.take(), 1U);

  EXPECT_EQ(io().read8(atBlock(1, kIsr)), kIsrTxRdy | kIsrRxRdy);
  static_cast<void>(get(kRhr));
  interrupt.enable();
  EXPECT_EQ(interrupt.take(), 0U);
}

TEST_F(OctalUartModelTest, TheSecondHalfUsesTheSecondRequestLine) {
  plug({});
  auto& interrupt = carrier_.site(0).interrupt(1);
  interrupt.enable();
  io().write8(at(5, kCr), kCrEnableTx);

  io().write8(atBlock(2, kImr), isrOf(5, kIsrTxRdy));

  EXPECT_EQ(interrupt.take(), 1U);
  EXPECT_EQ(carrier_.site(0).interrupt(0).take(), 0U);
}

TEST_F(OctalUartModelTest, HasATerminalBehindEachPort) {
  auto& model = plug({.terminals = true});
  setUp();
  const FileDescriptor instrument(
      checkCall(::open(model.terminal(kChannel).c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open"));

  set(kThr, 'q');
  char question = 0;
  ASSERT_EQ(::read(instrument.get(), &question, 1), 1);
  ASSERT_EQ(::write(instrument.get(), "a", 1), 1);

  EXPECT_EQ(question, 'q');
  while ((get(kSr) & kSrRxRdy) == 0) std::this_thread::yield();
  EXPECT_EQ(get(kRhr), 'a');
}

}  // namespace
}  // namespace mpf::test
