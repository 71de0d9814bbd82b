// SPDX-License-Identifier: MIT
// openPosixTerminal: a terminal device of this host as a SerialPort, from /dev/ttyS0 to a USB
// adapter that users plug in and out.
//
//   const auto port = openPosixTerminal({.device = "/dev/ttyS0", .settings = {.baud = 9600}});
//   BoundSerialPort line(*port, handler);
//
// The device is opened exclusively and in raw mode. Any baud rate that its driver can make is
// possible, not only those that have a constant in termios.
//
// When the device is unplugged, the state of the port is `unplugged`, and requests fail at once.
// The port tries to open the same path again, first after 20 ms, later once a second, and
// applies the settings that were in force.
//
// Threads  each port has a thread of its own; see SerialPort.
// Crash    the kernel closes the device and removes its locks.
// Trust    see SerialPort.
#pragma once

#include <memory>
#include <string>

#include <mpf/drivers/serial/serial_port.h>

namespace mpf {

struct PosixTerminalOptions {
  // The path of the device. Names in /dev/serial/by-id stay the same when a USB adapter is plugged
  // in at another place.
  std::string device;
  // A field that is 0 keeps the setting that the device has.
  SerialSettings settings = {};
  // What to do when the device cannot be opened. true: openPosixTerminal() returns at once, and the
  // port is unplugged until an attempt succeeds. false: openPosixTerminal() throws.
  bool waitForDevice = false;
};

// Opens the device and starts the thread of the port.
//
//   returns  the port, which the caller owns; plugged, unless waitForDevice is set
//   throws   std::invalid_argument for settings that problemOf() refuses;
//            std::runtime_error, unless waitForDevice is set, when the device is absent, in use or
//            not a terminal, or when it does not accept the settings: what() names the device and
//            the reason;
//            std::system_error when the process has no more descriptors or threads
[[nodiscard]] std::unique_ptr<SerialPort> openPosixTerminal(const PosixTerminalOptions& options);

}  // namespace mpf
