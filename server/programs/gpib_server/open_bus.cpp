// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/open_bus.h"

#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/gpib/open_gpib_controller.h>

#include "base/stop_bell.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kRetryEvery{500};

}  // namespace

std::unique_ptr<GpibBus> openBus(GpibStartOptions& options, const ServerLog& log, StopBell& stop) {
  if (const auto* const start = options.ti9914.find(options.module)) {
    auto controller = openTi9914(options.ti9914, *start, options.hardware, log, stop);
    return controller ? std::make_unique<GpibBus>(std::move(controller)) : nullptr;
  }
  for (std::string logged;;) {
    try {
      return std::make_unique<GpibBus>(openGpibController(options.module));
    } catch (const std::invalid_argument& error) {
      if (options.module.find(':') != std::string::npos) throw;  // it has the form of a device
      throw std::invalid_argument(
          fmt::format("{}; or the MODULE of --ti9914 MODULE,CARRIER,SITE[,VECTOR]", error.what()));
    } catch (const std::runtime_error& error) {
      if (!options.hardware.waits()) throw;
      if (std::exchange(logged, error.what()) != error.what())
        log->warn("waiting for the controller: {}", error.what());
    }
    if (stop.wait(kRetryEvery)) return nullptr;
  }
}

}  // namespace mpf
