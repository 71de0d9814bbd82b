// SPDX-License-Identifier: MIT
// openBus(): the bus of mpf-gpib-server, with a controller of any kind.
#pragma once

#include <memory>

#include <mpf/drivers/gpib/gpib_bus.h>

#include "base/stop_bell.h"
#include "server/programs/gpib_server/start_options.h"
#include "server/programs/server_log.h"

namespace mpf {

// Opens the controller that options.module names. With --wait it waits until the controller can be
// used, and returns null when SIGINT or SIGTERM arrived meanwhile.
//   options, log  outlive the bus
//   throws        as openTi9914() and openGpibController()
[[nodiscard]] std::unique_ptr<GpibBus> openBus(GpibStartOptions& options, const ServerLog& log,
                                               StopBell& stop);

}  // namespace mpf
