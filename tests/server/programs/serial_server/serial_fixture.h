// SPDX-License-Identifier: MIT
// SerialServerTest: a serial server on a real pseudo-terminal with an instrument at its far end,
// and its client.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include <mpf/drivers/serial/posix_terminal.h>
#include <mpf/serial_commands.h>
#include <mpf/sync_client.h>

#include "drivers/serial/polled_serial_port.h"
#include "drivers/serial/terminal_line.h"
#include "server/programs/serial_server/serial_server.h"
#include "tests/server/programs/serial_server/ask_serial.h"
#include "tests/support/instrument.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using namespace std::chrono_literals;

// The port of openPosixTerminal(), with public taps(): tests look at its taps, and show them bytes
// that a pseudo-terminal cannot deliver.
struct OpenPort : PolledSerialPort {
  explicit OpenPort(const PosixTerminalOptions& options)
      : PolledSerialPort(std::make_unique<TerminalLine>(options.device, options.settings),
                         options.waitForDevice) {}
  using SerialPort::taps;
};

class SerialServerTest : public testing::Test {
 protected:
  void start(const SerialServerOptions& options = {
                 .bufferBytes = 100, .eom = "\r\n", .circularBuffer = true}) {
    serial_ = std::make_unique<SerialServer>(server_, port_, options, log_);
    thread_ = std::thread([this] { server_.run(); });
    ASSERT_TRUE(client_.connectWait(60s));
  }
  void TearDown() override {
    server_.interrupt();
    if (thread_.joinable()) thread_.join();
  }
  static std::string linkPath() {
    static int count = 0;
    return std::filesystem::temp_directory_path() /
           ("mpf-serial-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
  }

  using Reply = SerialReply;
  // Sends a request with a timeout in milliseconds, unless `fields` has another cmd.
  Reply ask(std::string_view text, const Char8Array& fields) {
    return askSerial(client_, text, fields);
  }
  static Char8Array fieldsOf(std::int32_t cmd, std::int32_t timeoutMs = 60'000) {
    return {.timeout = timeoutMs, .cmd = cmd | serial::cmdTimeoutMilliseconds};
  }

  Watchdog watchdog_{"serial server test"};
  ServerLog log_{"test", "off"};
  std::string path_ = linkPath();
  Instrument instrument_{path_};
  OpenPort port_{{.device = path_, .settings = {9600, 1, 8, 'N', 'N'}}};
  TestBackplane backplane_;
  MessageServer server_{backplane_, "serial[0]"};
  std::unique_ptr<SerialServer> serial_;
  std::thread thread_;
  SyncClient client_{backplane_, "serial[0]"};
};

}  // namespace mpf::test
