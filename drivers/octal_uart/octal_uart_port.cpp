// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_port.h"

#include "drivers/octal_uart/octal_uart_line.h"
#include "drivers/serial/polled_serial_port.h"

namespace mpf {

std::unique_ptr<SerialPort> openOctalUartPort(OctalUart& uart, int number,
                                              const OctalUartPortOptions& options) {
  return std::make_unique<PolledSerialPort>(
      std::make_unique<OctalUartLine>(uart, number, options.settings), options.waitForModule);
}

}  // namespace mpf
