// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/tcp_serial_port.h>

#include "drivers/serial/polled_serial_port.h"
#include "drivers/serial/tcp_line.h"

namespace mpf {

std::unique_ptr<SerialPort> openTcpSerialPort(const TcpSerialOptions& options) {
  return std::make_unique<PolledSerialPort>(
      std::make_unique<TcpLine>(options.address, options.connectTimeout), options.waitForServer);
}

}  // namespace mpf
