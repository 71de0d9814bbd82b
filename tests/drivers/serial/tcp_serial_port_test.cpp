// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/tcp_serial_port.h>

#include <sys/socket.h>

#include <array>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <stdexcept>
#include <string>

#include "tests/drivers/serial/line_collector.h"
#include "tests/drivers/serial/terminal_server.h"
#include "tests/support/instrument.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class TcpSerialPortTest : public testing::Test {
 protected:
  TerminalServer server_;
  Instrument instrument_;
  LineCollector collector_;
};

std::string whyNot(const TcpSerialOptions& options) {
  try {
    const auto port = openTcpSerialPort(options);
    return {};
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST_F(TcpSerialPortTest, WriteReadGetsTheAnswer) {
  const auto port = openTcpSerialPort({.address = server_.address()});
  instrument_.connect(server_.accept());
  const BoundSerialPort line(*port, collector_);

  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);

  EXPECT_EQ(collector_.answer(), "MPF,INSTRUMENT,0,1.0\r\n");
}

TEST_F(TcpSerialPortTest, AllByteValuesPassUnchangedBothWays) {
  std::string every;
  for (int value = 0; value < 256; ++value) every += static_cast<char>(value);
  LineCollector collector("never comes");
  const auto port = openTcpSerialPort({.address = server_.address()});
  instrument_.connect(server_.accept());
  const BoundSerialPort line(*port, collector);

  EXPECT_EQ(line->write(bytesOf(every), kWatchdog), SerialPortStatus::success);
  instrument_.say(every);

  EXPECT_TRUE(instrument_.waitForReceived(every));
  EXPECT_TRUE(collector.waitForAll(every));
}

TEST_F(TcpSerialPortTest, AcceptsHostNames) {
  const auto port = openTcpSerialPort({.address = {"localhost", server_.address().port}});
  instrument_.connect(server_.accept());
  const BoundSerialPort line(*port, collector_);

  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
}

TEST_F(TcpSerialPortTest, AcceptsIpv6Addresses) {
  std::optional<TerminalServer> server;
  try {
    server.emplace(AF_INET6);
  } catch (const std::system_error& error) {
    GTEST_SKIP() << "this host has no IPv6: " << error.what();
  }
  const auto port = openTcpSerialPort({.address = server->address()});
  instrument_.connect(server->accept());
  const BoundSerialPort line(*port, collector_);

  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
}

TEST_F(TcpSerialPortTest, SettingsBelongToTheTerminalServer) {
  const auto port = openTcpSerialPort({.address = server_.address()});

  EXPECT_EQ(port->config({}), "");
  EXPECT_THAT(port->config({.baud = 9600}),
              HasSubstr("not supported over TCP: set it on the terminal server"));
}

TEST_F(TcpSerialPortTest, CannotSendABreak) {
  const auto port = openTcpSerialPort({.address = server_.address()});
  const BoundSerialPort line(*port, collector_);

  EXPECT_EQ(line->sendBreak(1ms), SerialPortStatus::failure);
}

TEST_F(TcpSerialPortTest, ReportsWhyItCannotBeOpened) {
  server_.switchOff();

  EXPECT_THAT(whyNot({.address = server_.address()}),
              HasSubstr("connect to " + server_.address().toString() + ": Connection refused"));
  // A label of more than 63 characters is no name, so no name server is asked.
  const std::string noName(64, 'a');
  EXPECT_THAT(whyNot({.address = {noName, "1"}}), HasSubstr("resolve " + noName + ":1"));
}

// The accept queue is full, so the kernel does not answer.
TEST_F(TcpSerialPortTest, TimesOutWhenTheServerDoesNotAnswer) {
  const TcpSerialOptions options{
      .address = server_.address(), .connectTimeout = 50ms, .waitForServer = true};
  std::array<std::unique_ptr<SerialPort>, 4> fillers;
  for (auto& filler : fillers) filler = openTcpSerialPort(options);

  const auto reason = [&] {
    for (;;) {
      if (auto why = whyNot({.address = server_.address(), .connectTimeout = 50ms}); !why.empty())
        return why;
    }
  }();

  EXPECT_THAT(reason, HasSubstr("no answer within 50 ms"));
}

TEST_F(TcpSerialPortTest, ALostConnectionFailsAnOutstandingRequest) {
  const auto port = openTcpSerialPort({.address = server_.address()});
  instrument_.connect(server_.accept());
  const BoundSerialPort line(*port, collector_);
  instrument_.behave({.isSilent = true});
  auto status = std::async(std::launch::async,
                           [&] { return line->writeRead(bytesOf("*IDN?\n"), kWatchdog); });
  ASSERT_TRUE(instrument_.waitForReceived("*IDN?\n"));

  server_.switchOff();
  instrument_.unplug();

  EXPECT_EQ(status.get(), SerialPortStatus::failure);
  EXPECT_EQ(port->counters().unplugs, 1U);
}

TEST_F(TcpSerialPortTest, ReconnectsAfterALoss) {
  const auto port = openTcpSerialPort({.address = server_.address()});
  instrument_.connect(server_.accept());
  const BoundSerialPort line(*port, collector_);
  server_.switchOff();
  instrument_.unplug();
  ASSERT_TRUE(port->waitForState(SerialPortState::unplugged, watchdog()));

  server_.switchOn();
  instrument_.connect(server_.accept());

  ASSERT_TRUE(port->waitForState(SerialPortState::plugged, watchdog()));
  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
}

TEST_F(TcpSerialPortTest, MayBeOpenedBeforeItsServerIsPresent) {
  server_.switchOff();
  const auto port = openTcpSerialPort({.address = server_.address(), .waitForServer = true});
  const BoundSerialPort line(*port, collector_);

  server_.switchOn();
  instrument_.connect(server_.accept());

  ASSERT_TRUE(port->waitForState(SerialPortState::plugged, watchdog()));
  EXPECT_EQ(line->writeRead(bytesOf("*IDN?\n"), kWatchdog), SerialPortStatus::success);
}

TEST_F(TcpSerialPortTest, AFloodDoesNotDelayTheDeadlineOfARequest) {
  LineCollector collector("never comes");
  const auto port = openTcpSerialPort({.address = server_.address()});
  const auto far = server_.accept();
  const BoundSerialPort line(*port, collector);
  std::jthread flood([&](const std::stop_token& stop) {
    const std::string noise(1000, '#');
    while (!stop.stop_requested() &&
           ::send(far.get(), noise.data(), noise.size(), MSG_NOSIGNAL) > 0) {
    }
  });

  EXPECT_EQ(line->read(50ms), SerialPortStatus::timeout);
}

}  // namespace
}  // namespace mpf::test
