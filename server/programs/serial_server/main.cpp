// SPDX-License-Identifier: MIT
// mpf-serial-server: one serial line, one server, one process. The old command was
// initSerialServer("serverName","portName",bufSize,queueSize,"eomstr",circularBufferMode).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <memory>
#include <stdexcept>

#include <mpf/drivers/serial/posix_terminal_port.h>
#include <mpf/drivers/serial/tcp_serial_port.h>
#include <mpf/server/programs/serial_server/serial_server.h>
#include <mpf/server/programs/serial_server/start_options.h>

namespace {

std::unique_ptr<mpf::SerialPort> openPort(const mpf::SerialStartOptions& options) {
  constexpr std::string_view kTcp = "tcp:";
  if (options.port.starts_with(kTcp)) {
    mpf::TcpSerialOptions tcp;
    tcp.address = mpf::TcpAddress::parse(options.port.substr(kTcp.size()));
    tcp.waitForServer = options.wait;
    return std::make_unique<mpf::TcpSerialPort>(tcp);
  }
  mpf::PosixTerminalOptions terminal;
  terminal.device = options.port;
  terminal.settings = options.settings;
  terminal.waitForDevice = options.wait;
  return std::make_unique<mpf::PosixTerminalPort>(terminal);
}

}  // namespace

int main(int argc, char** argv) try {
  mpf::SerialStartOptions options;
  if (const auto exit = options.parse(argc, argv)) return *exit;
  const auto port = openPort(options);
  mpf::MessageServer server(mpf::Backplane::attach(options.backplane), options.server, options.messages);
  const mpf::SerialServer serial(server, *port, options.serial);
  fmt::print("mpf-serial-server: serving {} as \"{}\" at location {}\n", port->description(), options.server, server.location());
  std::fflush(stdout);
  return server.runUntilSignal();
} catch (const std::exception& error) {
  fmt::print(stderr, "mpf-serial-server: {}\n", error.what());
  return 1;
}
