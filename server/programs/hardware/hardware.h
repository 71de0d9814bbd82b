// SPDX-License-Identifier: MIT
// Hardware: what all programs that drive Industry Pack modules have: carriers on the command line,
// modules on them, and waiting for both.
//
//   mpf-dac128v-server dac ipac IP_a --carrier ipac=tpci200:0000:03:00.0
//   mpf-dac128v-server dac ipac IP_a --carrier ipac=model
//
//   Hardware hardware;
//   hardware.addTo(app);                              // --carrier NAME=KIND[:PARAMETERS], --wait,
//   --wires FILE, --real-time N ... parse ... auto* const module = hardware.open({"dac", "ipac",
//   "IP_a"}, kDac128v, [] { return std::make_unique<Dac128vModel>(); }, log); if (module ==
//   nullptr) return 0;                  // told to stop while it waited ... return
//   runServer(server, *module, log);
//
// Threads  one at a time: the program's main thread at start, or later whoever opens what was not
//          there.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include <mpf/drivers/industry_pack/carrier.h>
#include <mpf/drivers/industry_pack/device_model.h>
#include <mpf/drivers/industry_pack/model_wires.h>
#include <mpf/drivers/industry_pack/module.h>
#include <mpf/message_server.h>
#include <mpf/real_time_priority.h>

#include "server/programs/server_log.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
}

namespace mpf {

class StopBell;

// The first arguments of every old command: initDAC128V(module, carrier, site, ...).
struct ModulePlace {
  std::string name;
  std::string carrier;
  std::string site;

  // Adds them as arguments; `aboutName` says what the name is for. `app` must not outlive this.
  void addTo(CLI::App& app, const std::string& aboutName);
};

class Hardware {
 public:
  using MakeModel = std::function<std::unique_ptr<DeviceModel>()>;

  Hardware() : modules_(carriers_) {}

  // Adds the options; `app` must not outlive this.
  void addTo(CLI::App& app);
  // The module at `place`, and its carrier first if that is not there yet; on a carrier of models
  // it is plugged in first. With --wait it waits for both, and says what for whenever that changes;
  // null: SIGINT or SIGTERM came meanwhile.
  //   throws  what wires(), createCarrier() and IndustryPackModules::create() throw;
  //           std::invalid_argument when no option says what the carrier is
  [[nodiscard]] IndustryPackModule* open(const ModulePlace& place, const ModuleKind& kind,
                                         const MakeModel& makeModel, const ServerLog& log);
  // The same for a program that has begun to serve: null as well when `stop` has rung before.
  [[nodiscard]] IndustryPackModule* open(const ModulePlace& place, const ModuleKind& kind,
                                         const MakeModel& makeModel, const ServerLog& log,
                                         StopBell& stop);

  // As open() without --wait.
  //   throws  in addition what isForGood() is for
  [[nodiscard]] IndustryPackModule& openNow(const ModulePlace& place, const ModuleKind& kind,
                                            const MakeModel& makeModel, const ServerLog& log);
  // Wrong parameters and a bus that this host does not have: what is no use to wait for.
  [[nodiscard]] static bool isForGood(const std::runtime_error& error);

  // Says at which priority the interrupts of modules are served, for a driver that has interrupts.
  void logPriority(const ServerLog& log) const;

  // --wait
  [[nodiscard]] bool waits() const noexcept { return waits_; }
  [[nodiscard]] IndustryPackModules& modules() noexcept { return modules_; }

  // What models of other processes are wired to; null without --wires. It outlives the models.
  //   throws  as ModelWires
  [[nodiscard]] ModelWires* wires();

 private:
  void createCarrierOf(const ModulePlace& place, const ServerLog& log);
  void plugModel(const ModulePlace& place, const MakeModel& makeModel);

  std::map<std::string, std::string> kinds_;  // NAME to KIND[:PARAMETERS]
  bool waits_ = false;
  int priority_ = kInterruptPriority;  // --real-time
  std::string wiresPath_;
  std::unique_ptr<ModelWires> wires_;  // before the carriers, whose models use it
  IndustryPackCarriers carriers_;
  IndustryPackModules modules_;
};

// Says that `server` serves `module`, and serves it until SIGINT or SIGTERM. Returns the exit
// status of the program.
[[nodiscard]] int runServer(MessageServer& server, const IndustryPackModule& module,
                            const ServerLog& log);

}  // namespace mpf
