// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/posix_terminal.h>

#include "drivers/serial/polled_serial_port.h"
#include "drivers/serial/terminal_line.h"

namespace mpf {

std::unique_ptr<SerialPort> openPosixTerminal(const PosixTerminalOptions& options) {
  return std::make_unique<PolledSerialPort>(
      std::make_unique<TerminalLine>(options.device, options.settings), options.waitForDevice);
}

}  // namespace mpf
