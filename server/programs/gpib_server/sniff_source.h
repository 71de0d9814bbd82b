// SPDX-License-Identifier: MIT
// sniffSourceOf(): the bytes of a GPIB bus as records for listeners (include/mpf/gpib_sniff.h).
#pragma once

#include <mpf/drivers/gpib/gpib_bus.h>

#include "server/programs/sniff/sniff_server.h"

namespace mpf {

//   bus  must outlive the source and what it returns
[[nodiscard]] SniffSource sniffSourceOf(GpibBus& bus);

}  // namespace mpf
