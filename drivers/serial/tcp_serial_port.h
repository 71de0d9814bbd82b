// SPDX-License-Identifier: MIT
// TcpSerialPort: a port of a terminal server that passes bytes as they are ("raw TCP"), by IPv4,
// IPv6 or name.
//
// Baud rate and the like are set on the terminal server; config() says so. A lost connection is an
// unplug: requests fail at once until the connection, which is tried again ever less often, is
// back.
//
// Threads  see SerialPort.
// Crash    the kernel closes the connection.
// Trust    see SerialPort.
#pragma once

#include <chrono>
#include <memory>

#include "drivers/serial/polled_serial_port.h"
#include "drivers/serial/tcp_line.h"

namespace mpf {

struct TcpSerialOptions {
  TcpAddress address;  // TcpAddress::parse("moxa1:4001")
  std::chrono::milliseconds connectTimeout{5000};
  // when it cannot be reached: be unplugged and go on trying, instead of throwing
  bool waitForServer = false;
};

class TcpSerialPort : public PolledSerialPort {
 public:
  // Unless waitForServer, waits for the first attempt to connect, and throws std::runtime_error
  // when it fails.
  explicit TcpSerialPort(const TcpSerialOptions& options)
      : PolledSerialPort(std::make_unique<TcpLine>(options.address, options.connectTimeout),
                         options.waitForServer) {}
};

}  // namespace mpf
