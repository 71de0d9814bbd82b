// SPDX-License-Identifier: MIT
// openOctalUartPort: a port of an octal UART module as a SerialPort (manual, "initOctalUARTPort").
//
//   const auto port = openOctalUartPort(uart, 3, {.settings = {.baud = 38400}});
//   BoundSerialPort line(*port, handler);
//
// When the module is pulled out, requests fail at once. When it is back, the port applies the
// settings that were in force.
//
// Threads  each port has a thread of its own; see SerialPort.
// Crash    see OctalUart.
// Trust    see SerialPort.
#pragma once

#include <memory>

#include <mpf/drivers/serial/serial_port.h>

#include "drivers/octal_uart/octal_uart.h"

namespace mpf {

struct OctalUartPortOptions {
  // A field that is 0 means the usual value: 9600 baud, 8 bits, no parity, 1 stop bit, no flow
  // control.
  SerialSettings settings = {};
  // What to do when the module does not answer. true: openOctalUartPort() returns at once, and the
  // port is unplugged until an attempt succeeds. false: openOctalUartPort() throws.
  bool waitForModule = false;
};

// Reserves port `number` of the module, sets up its channel and starts the thread of the port.
//
//   uart     outlives the port
//   returns  the port, which the caller owns; plugged, unless waitForModule is set
//   throws   std::invalid_argument for settings that the chip does not support, and when the module
//            has no port `number` or the port is in use;
//            std::runtime_error, unless waitForModule is set, when the module does not answer;
//            std::system_error when the process has no more descriptors or threads
[[nodiscard]] std::unique_ptr<SerialPort> openOctalUartPort(OctalUart& uart, int number,
                                                            const OctalUartPortOptions& options);

}  // namespace mpf
