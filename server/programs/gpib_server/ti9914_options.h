// SPDX-License-Identifier: MIT
// Ti9914Options: the options that define GPIB controllers on Industry Pack modules, and the
// instruments on the model of such a module. openTi9914(): opens a module.
//
//   --ti9914 MODULE,CARRIER,SITE[,VECTOR]     initGpibGsTi9914
//   --meter ADDRESS[,WIRE]                    a voltmeter on the model of a module
//
// Threads  the main thread of the program, at start.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <mpf/drivers/gpib/gpib_controller.h>

#include "server/programs/hardware/hardware.h"

namespace mpf {

struct Ti9914Start {
  ModulePlace place;
  std::optional<int> vector;
};

struct MeterStart {
  GpibAddress address;
  std::string wire;  // what it measures; empty: the readings of the manual
};

struct Ti9914Options {
  std::vector<Ti9914Start> modules;
  std::vector<MeterStart> meters;  // empty: one at its usual address, 22

  // Adds the options to `app`, which fills this and must not outlive it.
  void addTo(CLI::App& app);
  // Returns null when no module has that name.
  [[nodiscard]] const Ti9914Start* find(const std::string& module) const;
};

// Opens `start`, one of options.modules. On a model carrier, each module has a bus of its own
// with all meters. With --wait it waits for the module, and returns null when `stop` has rung.
//   log      outlives the controller, which logs faults of its interrupts
//   throws  as Hardware::open(), IndustryPackModules::takeVector() and Ti9914Controller;
//           std::invalid_argument when two meters have the same address, or a meter has a wire and
//           there is no --wires
[[nodiscard]] std::unique_ptr<GpibController> openTi9914(const Ti9914Options& options,
                                                         const Ti9914Start& start,
                                                         Hardware& hardware, const ServerLog& log,
                                                         StopBell& stop);

}  // namespace mpf
