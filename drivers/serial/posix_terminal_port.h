// SPDX-License-Identifier: MIT
// PosixTerminalPort: a terminal line of this host, from /dev/ttyS0 to a USB adapter that comes and
// goes.
//
// Every speed the driver can make, 5 to 8 bits, parity, 1 or 2 stop bits, RTS/CTS. The device is
// opened exclusively. When it is unplugged, requests fail at once; when a device of that name is
// back, it is opened again and gets the same settings.
//
// Threads  see SerialPort.
// Crash    the kernel closes the device.
// Trust    see SerialPort.
#pragma once

#include <memory>
#include <string>

#include "drivers/serial/polled_serial_port.h"
#include "drivers/serial/terminal_line.h"

namespace mpf {

struct PosixTerminalOptions {
  std::string device;  // names that stay the same are in /dev/serial/by-id
  // Where 0: as the device was left by the last program.
  SerialSettings settings = {};  // NOLINT(readability-redundant-member-init): g++ wants it
  // when it cannot be opened: be unplugged and wait, instead of throwing
  bool waitForDevice = false;
};

class PosixTerminalPort : public PolledSerialPort {
 public:
  //   throws  std::invalid_argument for settings that no line can have; unless waitForDevice,
  //           std::runtime_error when the device is absent, in use, no terminal, or does not accept
  //           the settings
  explicit PosixTerminalPort(const PosixTerminalOptions& options)
      : PolledSerialPort(std::make_unique<TerminalLine>(options.device, options.settings),
                         options.waitForDevice) {}
};

}  // namespace mpf
