// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/serial_port.h>

#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

#include <mpf/drivers/serial/posix_terminal.h>

#include "tests/drivers/serial/line_collector.h"
#include "tests/support/instrument.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

constexpr auto kSuccess = SerialPortStatus::success;
constexpr auto kTimeout = SerialPortStatus::timeout;
constexpr auto kFailure = SerialPortStatus::failure;

// A port on a pseudo-terminal with an instrument at the far end.
class SerialPortTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  Instrument instrument_{folder_.file("tty")};
  LineCollector collector_;
  const std::unique_ptr<SerialPort> owner_ = openPosixTerminal({.device = folder_.file("tty")});
  SerialPort& port_ = *owner_;
};

TEST_F(SerialPortTest, WriteReadGetsTheAnswerWithItsTerminator) {
  const BoundSerialPort line(port_, collector_);

  const auto status = line->writeRead(bytesOf("*IDN?\n"), kWatchdog);

  EXPECT_EQ(status, kSuccess);
  EXPECT_EQ(collector_.answer(), "MPF,INSTRUMENT,0,1.0\r\n");
  EXPECT_EQ(line->getStatus(), kSuccess);
}

TEST_F(SerialPortTest, WriteSendsAllBytes) {
  const BoundSerialPort line(port_, collector_);
  const std::string text(20'000, 'x');

  EXPECT_EQ(line->write(bytesOf(text + "\n"), kWatchdog), kSuccess);

  EXPECT_TRUE(instrument_.waitForReceived(text + "\n"));
  EXPECT_EQ(line->counters().bytesOut, text.size() + 1);
}

TEST_F(SerialPortTest, AllByteValuesPassUnchangedBothWays) {
  std::string every;
  for (int value = 0; value < 256; ++value) every += static_cast<char>(value);
  LineCollector collector("never comes");
  const BoundSerialPort line(port_, collector);

  EXPECT_EQ(line->write(bytesOf(every), kWatchdog), kSuccess);
  instrument_.say(every);

  EXPECT_TRUE(instrument_.waitForReceived(every));
  EXPECT_TRUE(collector.waitForAll(every));
}

TEST_F(SerialPortTest, WaitsForASlowAnswer) {
  const BoundSerialPort line(port_, collector_);
  instrument_.behave({.delay = 50ms});

  EXPECT_EQ(line->writeRead(bytesOf("MEAS:VOLT?\n"), kWatchdog), kSuccess);

  EXPECT_EQ(collector_.answer(), "1.234\r\n");
}

TEST_F(SerialPortTest, JoinsAnAnswerThatArrivesInPieces) {
  const BoundSerialPort line(port_, collector_);
  instrument_.behave({.gap = 2ms});

  EXPECT_EQ(line->writeRead(bytesOf("ECHO in pieces\n"), kWatchdog), kSuccess);

  EXPECT_EQ(collector_.answer(), "in pieces\r\n");
}

TEST_F(SerialPortTest, NoiseBeforeTheAnswerReachesTheHandler) {
  const BoundSerialPort line(port_, collector_);
  instrument_.behave({.noise = std::string("\x00\xff", 2)});

  EXPECT_EQ(line->writeRead(bytesOf("MEAS:VOLT?\n"), kWatchdog), kSuccess);

  EXPECT_EQ(collector_.answer(), std::string("\x00\xff", 2) + "1.234\r\n");
}

TEST_F(SerialPortTest, SilenceEndsInTimeout) {
  const BoundSerialPort line(port_, collector_);
  instrument_.behave({.isSilent = true});

  const auto status = line->writeRead(bytesOf("MEAS:VOLT?\n"), 20ms);

  EXPECT_EQ(status, kTimeout);
  EXPECT_EQ(line->getStatus(), kTimeout);
  EXPECT_THAT(collector_.ends(), ElementsAre(kTimeout));
  EXPECT_EQ(line->counters().timeouts, 1U);
}

TEST_F(SerialPortTest, ADeadlineThatWasSetEarlierApplies) {
  const BoundSerialPort line(port_, collector_);
  instrument_.behave({.isSilent = true});
  const auto deadline = Deadline::after(20ms);

  EXPECT_EQ(line->writeRead(bytesOf("MEAS:VOLT?\n"), deadline), kTimeout);
  EXPECT_EQ(line->read(deadline), kTimeout);

  EXPECT_TRUE(deadline.hasPassed());
}

TEST_F(SerialPortTest, TimeoutZeroReturnsAtOnceWithTheBytesThatHaveArrived) {
  const BoundSerialPort line(port_, collector_);
  instrument_.say("begun");
  ASSERT_TRUE(collector_.waitForAll("begun"));

  EXPECT_EQ(line->read(0ms), kTimeout);

  EXPECT_EQ(collector_.all(), "begun");
}

TEST_F(SerialPortTest, WriteWithTimeoutZeroSucceedsWhenTheKernelAcceptsAllBytes) {
  const BoundSerialPort line(port_, collector_);

  EXPECT_EQ(line->write(bytesOf("ECHO\n"), 0ms), kSuccess);

  EXPECT_TRUE(instrument_.waitForReceived("ECHO\n"));
}

TEST_F(SerialPortTest, NegativeTimeoutsEndAtOnceAndHugeOnesNever) {
  const BoundSerialPort line(port_, collector_);

  EXPECT_EQ(line->read(std::chrono::milliseconds::min()), kTimeout);
  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), std::chrono::milliseconds::max()), kSuccess);
}

TEST_F(SerialPortTest, HandlerGetsBytesWithNoReadOutstanding) {
  const BoundSerialPort line(port_, collector_);

  instrument_.say("alarm\r\n");

  EXPECT_TRUE(collector_.waitForAll("alarm\r\n"));
  EXPECT_THAT(collector_.ends(), ElementsAre());
}

// Circular buffer mode: no race between the check of the buffer and the start of the read.
TEST_F(SerialPortTest, BytesThatArrivedEarlierMaySatisfyARead) {
  collector_.acceptEarlier();
  const BoundSerialPort line(port_, collector_);
  instrument_.say("alarm\r\n");
  ASSERT_TRUE(collector_.waitForAll("alarm\r\n"));

  EXPECT_EQ(line->read(kWatchdog), kSuccess);
}

TEST_F(SerialPortTest, BytesAfterTheEndBelongToNoRead) {
  const BoundSerialPort line(port_, collector_);
  instrument_.behave({.answerEnd = "\r\nmore"});

  EXPECT_EQ(line->writeRead(bytesOf("ECHO one\n"), kWatchdog), kSuccess);

  EXPECT_EQ(collector_.answer(), "one\r\n");
  EXPECT_TRUE(collector_.waitForAll("one\r\nmore"));
}

TEST_F(SerialPortTest, HandlerMayFailARead) {
  LineCollector collector("\r\n", "ERR");
  const BoundSerialPort line(port_, collector);

  EXPECT_EQ(line->writeRead(bytesOf("ECHO ERR\n"), kWatchdog), kFailure);

  EXPECT_THAT(collector.ends(), ElementsAre(kFailure));
  EXPECT_EQ(line->counters().failures, 1U);
}

TEST_F(SerialPortTest, ASecondBinderIsRefusedUntilRelease) {
  LineCollector second;
  {
    const BoundSerialPort line(port_, collector_);
    EXPECT_THROW(port_.bind(second), std::runtime_error);
  }

  const BoundSerialPort line(port_, second);

  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), kSuccess);
  EXPECT_EQ(collector_.all(), "");
}

TEST_F(SerialPortTest, WithoutBindingRequestsFail) {
  EXPECT_EQ(port_.writeRead(bytesOf("*IDN?\n"), kWatchdog), kFailure);
}

TEST_F(SerialPortTest, ReleaseEndsARequestThatIsOutstanding) {
  port_.bind(collector_);
  auto status = std::async(std::launch::async, [&] { return port_.read(Deadline::never()); });
  ASSERT_TRUE(collector_.waitForRead());

  port_.release();

  EXPECT_EQ(status.get(), kFailure);
  EXPECT_THAT(collector_.ends(), ElementsAre(kFailure));
}

TEST_F(SerialPortTest, ASecondRequestAtTheSameTimeFailsAndDoesNotDisturbTheFirst) {
  const BoundSerialPort line(port_, collector_);
  auto first = std::async(std::launch::async, [&] { return port_.read(kWatchdog); });
  ASSERT_TRUE(collector_.waitForRead());

  EXPECT_EQ(line->write(bytesOf("ECHO no\n"), kWatchdog), kFailure);
  instrument_.say("answer\r\n");

  EXPECT_EQ(first.get(), kSuccess);
  EXPECT_EQ(instrument_.received(), "");
}

TEST_F(SerialPortTest, SettingsMayChangeWhileAReadIsOutstanding) {
  const BoundSerialPort line(port_, collector_);
  auto status = std::async(std::launch::async, [&] { return port_.read(kWatchdog); });
  ASSERT_TRUE(collector_.waitForRead());

  EXPECT_EQ(line->config({.baud = 19200}), "");
  instrument_.say("answer\r\n");

  EXPECT_EQ(status.get(), kSuccess);
}

TEST_F(SerialPortTest, SendBreakLastsForItsDuration) {
  const BoundSerialPort line(port_, collector_);
  const auto end = Deadline::after(20ms);

  EXPECT_EQ(line->sendBreak(20ms), kSuccess);

  EXPECT_TRUE(end.hasPassed());
}

}  // namespace
}  // namespace mpf::test
