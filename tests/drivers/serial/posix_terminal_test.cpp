// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/posix_terminal.h>

#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>
#include <thread>

#include "tests/drivers/serial/line_collector.h"
#include "tests/support/instrument.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class PosixTerminalTest : public testing::Test {
 protected:
  PosixTerminalOptions options() const { return {.device = folder_.file("tty")}; }
  PosixTerminalOptions optionsWith(const SerialSettings& settings) const {
    return {.device = folder_.file("tty"), .settings = settings};
  }

  TemporaryFolder folder_;
  Instrument instrument_{folder_.file("tty")};
  LineCollector collector_;
};

std::string whyNot(const PosixTerminalOptions& options) {
  try {
    const auto port = openPosixTerminal(options);
    return {};
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST_F(PosixTerminalTest, StartsWithItsSettings) {
  const auto port = openPosixTerminal(optionsWith(
      {.baud = 19200, .stopBits = 2, .bitsPerChar = 8, .parity = 'N', .flowControl = 'H'}));

  const auto line = instrument_.settings();

  EXPECT_EQ(::cfgetospeed(&line), speed_t{B19200});
  EXPECT_TRUE((line.c_cflag & CSTOPB) != 0);
  EXPECT_TRUE((line.c_cflag & CRTSCTS) != 0);
}

TEST_F(PosixTerminalTest, ZeroLeavesASettingAsItIs) {
  const auto port =
      openPosixTerminal(optionsWith({.baud = 19200, .stopBits = 2, .flowControl = 'H'}));

  EXPECT_EQ(port->config({.baud = 4800}), "");

  const auto line = instrument_.settings();
  EXPECT_EQ(::cfgetospeed(&line), speed_t{B4800});
  EXPECT_TRUE((line.c_cflag & CSTOPB) != 0);
  EXPECT_TRUE((line.c_cflag & CRTSCTS) != 0);
}

// A pseudo-terminal always has 8 bits and no parity, but reports success for all settings.
TEST_F(PosixTerminalTest, NamesTheSettingThatTheLineDoesNotAccept) {
  const auto port = openPosixTerminal(optionsWith({.baud = 9600}));

  EXPECT_THAT(port->config({.baud = 19200, .bitsPerChar = 7}),
              HasSubstr("does not accept bits per character 7"));
  EXPECT_THAT(port->config({.baud = 19200, .parity = 'E'}), HasSubstr("does not accept parity E"));
  EXPECT_THAT(port->config({.parity = 'Q'}), HasSubstr("parity 'Q'"));

  const auto line = instrument_.settings();
  EXPECT_EQ(::cfgetospeed(&line), speed_t{B9600}) << "all or nothing";
}

TEST_F(PosixTerminalTest, ReportsWhyItCannotBeOpened) {
  EXPECT_THAT(whyNot({.device = folder_.file("absent")}),
              AllOf(HasSubstr("open"), HasSubstr("absent"), HasSubstr("No such file")));
  EXPECT_THAT(whyNot({.device = "/dev/null"}), HasSubstr("open /dev/null: not a terminal"));
  EXPECT_THAT(whyNot(optionsWith({.bitsPerChar = 7})),
              HasSubstr("does not accept bits per character 7"));
  EXPECT_THAT(whyNot(optionsWith({.stopBits = 5})), HasSubstr("stop bits 5"));
}

TEST_F(PosixTerminalTest, OpensTheDeviceExclusively) {
  {
    const auto port = openPosixTerminal(options());
    EXPECT_THAT(whyNot(options()),
                AllOf(HasSubstr(folder_.file("tty")), HasSubstr("in use by another program")));
  }

  EXPECT_EQ(whyNot(options()), "");
}

// The far end reads nothing, so the kernel's buffer fills and the remaining bytes time out.
TEST_F(PosixTerminalTest, AWriteTimesOutWhileTheFarEndDoesNotRead) {
  const auto port = openPosixTerminal(options());
  const BoundSerialPort line(*port, collector_);
  instrument_.setReading(false);
  const std::string much(1'000'000, 'x');

  EXPECT_EQ(line->write(bytesOf(much), 50ms), SerialPortStatus::timeout);
  EXPECT_LT(line->counters().bytesOut, much.size());

  instrument_.setReading(true);
  EXPECT_EQ(line->writeRead(bytesOf("\n*IDN?\n"), kWatchdog), SerialPortStatus::success);
}

TEST_F(PosixTerminalTest, UnplugFailsAnOutstandingRequest) {
  const auto port = openPosixTerminal(options());
  const BoundSerialPort line(*port, collector_);
  instrument_.behave({.isSilent = true});
  auto status = std::async(std::launch::async,
                           [&] { return line->writeRead(bytesOf("*IDN?\n"), kWatchdog); });
  ASSERT_TRUE(instrument_.waitForReceived("*IDN?\n"));

  instrument_.unplug();

  EXPECT_EQ(status.get(), SerialPortStatus::failure);
  EXPECT_EQ(port->state(), SerialPortState::unplugged);
  EXPECT_THAT(port->unpluggedBecause(), HasSubstr(folder_.file("tty")));
  EXPECT_EQ(port->counters().unplugs, 1U);
}

TEST_F(PosixTerminalTest, WhileUnpluggedRequestsAndSettingsFailAtOnce) {
  const auto port = openPosixTerminal(options());
  const BoundSerialPort line(*port, collector_);
  instrument_.unplug();
  ASSERT_TRUE(port->waitForState(SerialPortState::unplugged, watchdog()));

  EXPECT_EQ(line->read(Deadline::never()), SerialPortStatus::failure);
  EXPECT_THAT(line->config({.baud = 9600}), HasSubstr("unplugged"));
}

TEST_F(PosixTerminalTest, KeepsItsSettingsWhenTheDeviceReturns) {
  const auto port = openPosixTerminal(optionsWith({.baud = 19200, .stopBits = 2}));
  const BoundSerialPort line(*port, collector_);
  ASSERT_EQ(line->config({.baud = 4800}), "");
  for (unsigned round = 1; round <= 3; ++round) {
    instrument_.unplug();
    ASSERT_TRUE(port->waitForState(SerialPortState::unplugged, watchdog()));

    instrument_.plugIn();

    ASSERT_TRUE(port->waitForState(SerialPortState::plugged, watchdog()));
    EXPECT_EQ(port->unpluggedBecause(), "");
    EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
    EXPECT_EQ(port->counters().unplugs, round);
    const auto settings = instrument_.settings();
    EXPECT_EQ(::cfgetospeed(&settings), speed_t{B4800});
    EXPECT_TRUE((settings.c_cflag & CSTOPB) != 0);
  }
}

TEST_F(PosixTerminalTest, MayBeOpenedBeforeItsDeviceIsPresent) {
  instrument_.unplug();
  const auto port = openPosixTerminal({.device = folder_.file("tty"), .waitForDevice = true});
  const BoundSerialPort line(*port, collector_);
  EXPECT_EQ(line->read(kWatchdog), SerialPortStatus::failure);

  instrument_.plugIn();

  ASSERT_TRUE(port->waitForState(SerialPortState::plugged, watchdog()));
  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
}

TEST_F(PosixTerminalTest, TapsSurviveAnUnplug) {
  const auto port = openPosixTerminal(options());
  const BoundSerialPort line(*port, collector_);
  std::atomic<int> seen = 0;
  const auto tap = port->attachTap(
      [&](std::span<const PeekedByte> bytes) { seen += static_cast<int>(bytes.size()); });
  instrument_.unplug();
  ASSERT_TRUE(port->waitForState(SerialPortState::unplugged, watchdog()));
  instrument_.plugIn();
  ASSERT_TRUE(port->waitForState(SerialPortState::plugged, watchdog()));

  EXPECT_EQ(line->writeRead(bytesOf("ECHO a\n"), kWatchdog), SerialPortStatus::success);

  EXPECT_EQ(seen, 10);
}

TEST_F(PosixTerminalTest, ReportsEachChangeOfStateOnce) {
  const Watchdog dog("change of state");
  const auto port = openPosixTerminal(options());
  std::vector<std::string> reports;
  port->onStateChange([&](SerialPortState state, const std::string& because) {
    reports.push_back(std::string(toString(state)) + (because.empty() ? "" : ", with a reason"));
  });
  instrument_.unplug();
  ASSERT_TRUE(port->waitForState(SerialPortState::unplugged, watchdog()));
  // until an attempt to open has failed, which is not a change of the state
  while (!port->unpluggedBecause().starts_with("open ")) std::this_thread::yield();
  instrument_.plugIn();
  ASSERT_TRUE(port->waitForState(SerialPortState::plugged, watchdog()));

  port->onStateChange({});
  instrument_.unplug();
  ASSERT_TRUE(port->waitForState(SerialPortState::unplugged, watchdog()));

  EXPECT_THAT(reports, ElementsAre("unplugged, with a reason", "plugged"));
}

}  // namespace
}  // namespace mpf::test
