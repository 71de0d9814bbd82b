// SPDX-License-Identifier: MIT
// mpf-serial-server: one serial line, one server, one process. The old command was
// initSerialServer("serverName","portName",bufSize,queueSize,"eomstr",circularBufferMode).
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <memory>

#include <mpf/drivers/serial/posix_terminal_port.h>
#include <mpf/drivers/serial/tcp_serial_port.h>
#include <mpf/server/programs/serial_server/serial_server.h>
#include <mpf/server/programs/serial_server/sniff_server.h>
#include <mpf/server/programs/serial_server/start_options.h>
#include <mpf/server/programs/serial_server/stop_thread.h>

namespace {

std::unique_ptr<mpf::SerialPort> openPort(const mpf::SerialStartOptions& options) {
  if (const auto address = options.tcpAddress()) {
    mpf::TcpSerialOptions tcp;
    tcp.address = mpf::TcpAddress::parse(*address);
    tcp.waitForServer = options.wait;
    return std::make_unique<mpf::TcpSerialPort>(tcp);
  }
  mpf::PosixTerminalOptions terminal;
  terminal.device = options.port;
  terminal.settings = options.settings;
  terminal.waitForDevice = options.wait;
  return std::make_unique<mpf::PosixTerminalPort>(terminal);
}

void logStateChanges(mpf::SerialPort& port, const mpf::ServerLog& log) {
  port.onStateChange([&log](mpf::SerialPortState state, const std::string& because) {
    if (state == mpf::SerialPortState::plugged) return log->info("the line is there");
    log->warn("the line is lost: {}", because);
  });
}

}  // namespace

int main(int argc, char** argv) try {
  mpf::SerialStartOptions options;
  if (const auto exit = options.parse(argc, argv)) return *exit;
  const auto& arguments = options.arguments;
  const mpf::ServerLog log("mpf-serial-server", arguments.logLevel);
  const auto port = openPort(options);
  logStateChanges(*port, log);
  const auto backplane = mpf::Backplane::attach(arguments.backplane);
  mpf::MessageServer server(backplane, options.server, arguments.messages);
  mpf::SerialServer serial(server, *port, options.serial, log);
  const mpf::SniffServer sniff(backplane, options.server, arguments.messages, *port, log);
  const mpf::StopThread stop([&] { serial.stop(); });
  log->info(R"(serving {} ({}) as "{}" at location {}; listeners: "{}")", port->description(), options.describeLine(), server.getName(),
            server.location(), sniff.getName());
  if (port->state() == mpf::SerialPortState::unplugged) log->warn("the line is not there yet: {}", port->unpluggedBecause());
  server.run();
  log->info("ends");
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "mpf-serial-server: {}\n", error.what());
  return 1;
}
