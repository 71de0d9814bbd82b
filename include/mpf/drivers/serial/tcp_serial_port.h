// SPDX-License-Identifier: MIT
// openTcpSerialPort: a port of a terminal server as a SerialPort. The terminal server passes bytes
// as they are ("raw TCP"; neither telnet nor RFC 2217).
//
//   const auto port = openTcpSerialPort({.address = TcpAddress::parse("moxa1:4001")});
//   BoundSerialPort line(*port, handler);
//
// Baud rate, parity and the other settings belong to the terminal server: config() refuses them,
// and sendBreak() fails.
//
// A lost connection is an unplug: requests fail at once. The port connects again, first after
// 20 ms, later once a second, and looks up the name each time. A terminal server that vanishes
// without closing the connection is detected within about 30 s.
//
// Threads  each port has a thread of its own, and one more while a name is looked up; see
//          SerialPort.
// Crash    the kernel closes the connection.
// Trust    see SerialPort.
#pragma once

#include <chrono>
#include <memory>

#include <mpf/drivers/serial/serial_port.h>
#include <mpf/drivers/serial/tcp_address.h>

namespace mpf {

struct TcpSerialOptions {
  TcpAddress address;
  // The longest time that one attempt may last, with the lookup of the name.
  std::chrono::milliseconds connectTimeout{5000};
  // What to do when the terminal server cannot be reached. true: openTcpSerialPort() returns at
  // once, and the port is unplugged until an attempt succeeds. false: openTcpSerialPort() waits for
  // the first attempt, and throws when it fails.
  bool waitForServer = false;
};

// Connects to the terminal server and starts the thread of the port.
//
//   returns  the port, which the caller owns; plugged, unless waitForServer is set
//   throws   std::runtime_error, unless waitForServer is set, when the name is unknown, the
//            connection is refused, or there is no answer within connectTimeout: what() names the
//            address and the reason;
//            std::system_error when the process has no more descriptors or threads
[[nodiscard]] std::unique_ptr<SerialPort> openTcpSerialPort(const TcpSerialOptions& options);

}  // namespace mpf
