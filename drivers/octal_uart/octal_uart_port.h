// SPDX-License-Identifier: MIT
// OctalUartPort: a port of an OctalUart as a SerialPort (manual, "initOctalUARTPort").
//
// When the module is pulled out, requests fail at once; when it is back, the port gets the same
// settings.
//
// Threads  see SerialPort; the port ends before its OctalUart.
// Crash    see OctalUart.
// Trust    see SerialPort.
#pragma once

#include <memory>

#include "drivers/octal_uart/octal_uart_line.h"
#include "drivers/serial/polled_serial_port.h"

namespace mpf {

struct OctalUartPortOptions {
  // 0 in a field: 9600 baud, 8 bits, no parity, 1 stop bit, no flow control.
  SerialSettings settings = {};  // NOLINT(readability-redundant-member-init): g++ wants it
  // when it does not answer: be unplugged and wait, instead of throwing
  bool waitForModule = false;
};

class OctalUartPort : public PolledSerialPort {
 public:
  //   throws  as OctalUartLine; unless waitForModule, std::runtime_error when the module does not
  //           answer
  OctalUartPort(OctalUart& uart, int number, const OctalUartPortOptions& options)
      : PolledSerialPort(std::make_unique<OctalUartLine>(uart, number, options.settings),
                         options.waitForModule) {}
};

}  // namespace mpf
