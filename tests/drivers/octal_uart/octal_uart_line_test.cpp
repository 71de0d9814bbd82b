// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_line.h"

#include <poll.h>

#include <stdexcept>

#include "octal_uart_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::ThrowsMessage;

using OpenState = SerialLine::OpenState;

// The thread of the test is the port's thread.
class OctalUartLineTest : public OctalUartTest {
 protected:
  static void waitUntilReadable(const OctalUartLine& line) {
    auto events = line.waitsFor();
    ASSERT_EQ(::poll(&events, 1, -1), 1);
  }
};

TEST_F(OctalUartLineTest, ReservesItsPortUntilItIsDestroyed) {
  auto& uart = start();
  {
    const OctalUartLine line(uart, 3, {});
    EXPECT_EQ(line.description(), "port 3 of UART (carrier ipac, site IP_a)");
    EXPECT_THAT([&] { const OctalUartLine other(uart, 3, {}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("port 3 is in use")));
  }
  EXPECT_NO_THROW(const OctalUartLine again(uart, 3, {}));
  EXPECT_THROW(const OctalUartLine absent(uart, 8, {}), std::invalid_argument);
}

TEST_F(OctalUartLineTest, RefusesSettingsThatTheChipDoesNotSupportAndReservesNothing) {
  auto& uart = start();
  EXPECT_THAT([&] { const OctalUartLine line(uart, 3, {.baud = 115200}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("port 3 of UART")));
  EXPECT_NO_THROW(const OctalUartLine line(uart, 3, {}));
}

TEST_F(OctalUartLineTest, OpensWithTheUsualSettings) {
  OctalUartLine line(start(), 3, {.stopBits = 2});

  EXPECT_EQ(line.tryOpen(), OpenState::open);

  EXPECT_EQ(settingsInChip(3), (SerialSettings{9600, 2, 8, 'N', 'N'}));
  EXPECT_TRUE(requestsToSend(3));
  line.close();
  EXPECT_FALSE(requestsToSend(3));
}

TEST_F(OctalUartLineTest, AppliesChangedSettingsAtOnceAndWhenItIsReopened) {
  OctalUartLine line(start(), 3, kFast);
  EXPECT_EQ(line.tryConfigure({.baud = 1200}), "");
  ASSERT_EQ(line.tryOpen(), OpenState::open);
  EXPECT_EQ(settingsInChip(3).baud, 1200);

  EXPECT_EQ(line.tryConfigure({.parity = 'E'}), "");
  EXPECT_THAT(line.tryConfigure({.baud = 50, .parity = 'O'}), HasSubstr("baud 50"));

  EXPECT_EQ(settingsInChip(3), (SerialSettings{1200, 1, 8, 'E', 'N'}));
  line.close();
  ASSERT_EQ(line.tryOpen(), OpenState::open);
  EXPECT_EQ(settingsInChip(3), (SerialSettings{1200, 1, 8, 'E', 'N'}));
}

TEST_F(OctalUartLineTest, ReadsBytesAndThenTheirOverruns) {
  OctalUartLine line(start({.time = OctalUartModelTime::stepped}), 3, kFast);
  ASSERT_EQ(line.tryOpen(), OpenState::open);
  std::vector<LineByte> bytes;
  EXPECT_TRUE(line.tryRead(bytes));
  EXPECT_TRUE(bytes.empty());
  model_->farEndSend(3, "abcdef");

  model_->advance(10 * byteTime(kFast));  // in one step: the driver cannot read in between
  model_->waitUntilServed();

  waitUntilReadable(line);
  EXPECT_EQ(line.takeOverruns(), 0U) << "they belong to bytes that are not read yet";
  EXPECT_TRUE(line.tryRead(bytes));
  ASSERT_EQ(bytes.size(), 4U);
  EXPECT_EQ(bytes.back().value, 'f');
  EXPECT_EQ(line.takeOverruns(), 1U);
  EXPECT_EQ(line.takeOverruns(), 0U);
}

TEST_F(OctalUartLineTest, IsLostWithItsModule) {
  OctalUartLine line(start(), 3, kFast);
  ASSERT_EQ(line.tryOpen(), OpenState::open);
  std::vector<LineByte> bytes;

  carrier_.unplug("IP_a");
  waitUntilReadable(line);

  EXPECT_FALSE(line.tryRead(bytes));
  EXPECT_THAT(line.problem(), HasSubstr("no module"));
  EXPECT_EQ(line.tryWrite(bytesOf("a")), std::nullopt);
  EXPECT_FALSE(line.trySetBreak(true));
  EXPECT_EQ(line.tryOpen(), OpenState::failed);
  EXPECT_THAT(line.problem(), HasSubstr("no module"));
  plug({});
  EXPECT_EQ(line.tryOpen(), OpenState::open);
}

// RS-485: the end of the last byte causes no interrupt, so the line has a timer.
TEST_F(OctalUartLineTest, IsReadableUntilTheTransmitterIsSwitchedOff) {
  OctalUartLine line(start({.model = 0x48, .time = OctalUartModelTime::stepped}), 3, kFast);
  ASSERT_EQ(line.tryOpen(), OpenState::open);
  std::vector<LineByte> bytes;
  ASSERT_EQ(line.tryWrite(bytesOf("a")), 1U);
  ASSERT_TRUE(requestsToSend(3));

  EXPECT_TRUE(line.tryRead(bytes));  // sets the timer
  waitUntilReadable(line);
  EXPECT_TRUE(line.tryRead(bytes));
  EXPECT_TRUE(requestsToSend(3)) << "the byte is not sent yet";
  model_->advance(2 * byteTime(kFast));
  waitUntilReadable(line);
  EXPECT_TRUE(line.tryRead(bytes));

  EXPECT_FALSE(requestsToSend(3));
}

// timeToSend() is an estimate until the chip has the last byte, so the line must become readable
// then.
TEST_F(OctalUartLineTest, TheLineIsReadableWhenTheChipHasAllBytes) {
  auto& uart = start({.time = OctalUartModelTime::stepped});
  OctalUartLine line(uart, 1, kFast);
  ASSERT_EQ(line.tryOpen(), OpenState::open);

  ASSERT_EQ(line.tryWrite(bytesOf("abc")), 3U);
  model_->advance(byteTime(kFast));

  auto bell = line.waitsFor();
  EXPECT_EQ(::poll(&bell, 1, -1), 1);
}

TEST_F(OctalUartLineTest, AnInstantLineNeedsNoTimeToSend) {
  auto& uart = start();
  OctalUartLine line(uart, 1, {75, 1, 8, 'N', 'N'});
  ASSERT_EQ(line.tryOpen(), OpenState::open);

  ASSERT_EQ(line.tryWrite(bytesOf("at once")), 7U);

  EXPECT_EQ(model_->farEndReceived(1), "at once");
  EXPECT_EQ(line.timeToSend(), 0ms);
}

}  // namespace
}  // namespace mpf::test
