// SPDX-License-Identifier: MIT
// sniffSourceOf(): the bytes of a serial port as records for listeners
// (include/mpf/serial_sniff.h).
#pragma once

#include <mpf/drivers/serial/serial_port.h>

#include "server/programs/sniff/sniff_server.h"

namespace mpf {

//   port  must outlive the source and what it returns
[[nodiscard]] SniffSource sniffSourceOf(SerialPort& port);

}  // namespace mpf
