// SPDX-License-Identifier: MIT
// Hardware: the carriers and modules of a program that drives Industry Pack modules: it reads them
// from the command line, opens them, and waits for missing ones.
//
//   mpf-dac128v-server dac ipac IP_a --carrier ipac=tpci200:0000:03:00.0
//   mpf-dac128v-server dac ipac IP_a --carrier ipac=model
//
//   Hardware hardware;
//   hardware.addTo(app);  // --carrier NAME=KIND[:PARAMETERS] --wait --wires FILE --real-time N
//   ... parse ...
//   auto* const module = hardware.open({"dac", "ipac", "IP_a"}, kDac128v,
//                                      [] { return std::make_unique<Dac128vModel>(); }, log);
//   if (module == nullptr) return 0;  // stopped while it waited
//   ...
//   return runServer(server, *module, log);
//
// Threads  one at a time: the main thread of the program at start, later a thread that opens a
//          module that was missing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
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

  // Adds them as arguments. `app` must not outlive this.
  //   aboutName  the help text of the name
  void addTo(CLI::App& app, const std::string& aboutName);
};

class Hardware {
 public:
  using MakeModel = std::function<std::unique_ptr<DeviceModel>()>;

  Hardware() : modules_(carriers_) {}

  // Adds the options; `app` must not outlive this.
  void addTo(CLI::App& app);
  // Returns the module at `place`. Creates its carrier before if necessary; plugs the module in
  // before on a model carrier. With --wait it waits for both, and logs the reason whenever it
  // changes. Returns null when SIGINT or SIGTERM arrived while it waited.
  //   throws  what wires(), createCarrier() and IndustryPackModules::create() throw;
  //           std::invalid_argument when no option defines the carrier
  [[nodiscard]] IndustryPackModule* open(const ModulePlace& place, const ModuleKind& kind,
                                         const MakeModel& makeModel, const ServerLog& log);
  // The same for a program that already serves: returns null as well when `stop` has rung before.
  [[nodiscard]] IndustryPackModule* open(const ModulePlace& place, const ModuleKind& kind,
                                         const MakeModel& makeModel, const ServerLog& log,
                                         StopBell& stop);

  // Checks the carrier and the site of a module without opening a board.
  //   throws  std::invalid_argument; IndustryPackError for a carrier that this host cannot reach
  void check(const ModulePlace& place) const;

  // As open() without --wait.
  //   throws  also the errors that --wait would wait for
  [[nodiscard]] IndustryPackModule& openNow(const ModulePlace& place, const ModuleKind& kind,
                                            const MakeModel& makeModel, const ServerLog& log);
  // True for errors that waiting does not cure: wrong parameters, a bus that this host does not
  // have.
  [[nodiscard]] static bool isPermanent(const std::runtime_error& error);

  // Logs the priority at which the interrupts of modules are served, for drivers with interrupts.
  void logPriority(const ServerLog& log) const;

  // --wait
  [[nodiscard]] bool waits() const noexcept { return waits_; }
  [[nodiscard]] IndustryPackModules& modules() noexcept { return modules_; }

  // The wires between models of several processes; null without --wires. They outlive the models.
  //   throws  as ModelWires
  [[nodiscard]] ModelWires* wires();

 private:
  [[nodiscard]] const std::string& kindOf(const std::string& carrier) const;
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

// Parses the command line of a program that drives one module. With --check, checks its place, and
// the program ends.
//   returns  the exit status of a program that ends now
//   throws   what Hardware::check() throws
template <class Options>
[[nodiscard]] std::optional<int> parseOrCheck(Options& options, Hardware& hardware, int argc,
                                              char** argv) {
  if (const auto exit = options.parse(argc, argv, hardware)) return exit;
  if (!options.arguments.checkOnly) return std::nullopt;
  hardware.check(options.place);
  return 0;
}

// Logs what `server` serves, and serves until SIGINT or SIGTERM. Returns the exit status of the
// program.
[[nodiscard]] int runServer(MessageServer& server, const IndustryPackModule& module,
                            const ServerLog& log);

}  // namespace mpf
