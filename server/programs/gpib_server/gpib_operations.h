// SPDX-License-Identifier: MIT
// performGpib(): performs one request of a GPIB server on its bus.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <mpf/drivers/gpib/gpib_bus.h>

#include "server/programs/gpib_server/gpib_request.h"

namespace mpf {

// The parts of a reply that differ from its request, see include/mpf/gpib_commands.h.
struct GpibReply {
  std::int32_t status = 0;  // gpib::gpibStatus...
  std::int32_t extra = 0;
  std::vector<std::uint8_t> value{};
  std::string reason{};  // for the log; empty for success
};

// The status of a reply.
[[nodiscard]] std::int32_t statusOf(GpibStatus status) noexcept;

// Waits for the end of the operation.
//   request  valid; a lease or an operation on the bus, no subscription
//   user     the client
[[nodiscard]] GpibReply performGpib(GpibBus& bus, const GpibRequest& request, GpibUser user);

}  // namespace mpf
