// SPDX-License-Identifier: MIT
#include "server/programs/hardware/hardware.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/industry_pack/create_carrier.h>
#include <mpf/drivers/industry_pack/industry_pack_error.h>
#include <mpf/drivers/industry_pack/model_carrier.h>

#include "base/stop_bell.h"
#include "drivers/industry_pack/check_carrier.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kRetryEvery{500};

std::string unknownCarrier(const std::string& carrier) {
  return fmt::format(
      "carrier \"{0}\" is not defined; use --carrier {0}=KIND[:PARAMETERS] with one of these "
      "kinds:\n{1}",
      carrier, carrierKinds());
}

}  // namespace

void ModulePlace::addTo(CLI::App& app, const std::string& aboutName) {
  app.add_option("module", name, aboutName)->required();
  app.add_option("carrier", carrier, "Name of the carrier board that holds the module")->required();
  app.add_option("site", site, "Site of the module on the carrier: IP_a, IP_b, ...")->required();
}

void Hardware::addTo(CLI::App& app) {
  app.add_option_function<std::vector<std::string>>(
         "--carrier",
         [this](const std::vector<std::string>& options) {
           for (const auto& option : options) {
             const auto equals = option.find('=');
             if (equals == 0 || equals == std::string::npos)
               throw CLI::ValidationError(
                   "--carrier", "\"" + option + "\" does not have the form NAME=KIND[:PARAMETERS]");
             kinds_[option.substr(0, equals)] = option.substr(equals + 1);
           }
         },
         "Defines a carrier, NAME=KIND[:PARAMETERS]; kinds:\n" + carrierKinds())
      ->allow_extra_args(false)
      ->type_name("NAME=KIND");
  app.add_flag("--wait", waits_, "Start even if the board is missing, and wait for it");
  app.add_option("--wires", wiresPath_,
                 "File that connects the models of several programs; the first program creates it")
      ->type_name("FILE");
  app.add_option("--real-time", priority_,
                 "Real-time priority of the threads that serve interrupts, where permitted; "
                 "0: ordinary priority")
      ->type_name("N")
      ->check(CLI::Range(0, 99))
      ->capture_default_str();
}

ModelWires* Hardware::wires() {
  if (!wires_ && !wiresPath_.empty()) wires_ = std::make_unique<ModelWires>(wiresPath_);
  return wires_.get();
}

IndustryPackModule* Hardware::open(const ModulePlace& place, const ModuleKind& kind,
                                   const MakeModel& makeModel, const ServerLog& log) {
  StopBell stop;
  return open(place, kind, makeModel, log, stop);
}

IndustryPackModule* Hardware::open(const ModulePlace& place, const ModuleKind& kind,
                                   const MakeModel& makeModel, const ServerLog& log,
                                   StopBell& stop) {
  static_cast<void>(wires());  // an invalid file is an error, even with --wait
  for (std::string logged;;) {
    try {
      return &openNow(place, kind, makeModel, log);
    } catch (const std::invalid_argument&) {
      throw;  // waiting does not help
    } catch (const std::runtime_error& error) {
      if (!waits_ || isPermanent(error)) throw;
      if (std::exchange(logged, error.what()) != error.what())
        log->warn("waiting for the board: {}", error.what());
    }
    if (stop.wait(kRetryEvery)) return nullptr;
  }
}

bool Hardware::isPermanent(const std::runtime_error& error) {
  const auto* const known = dynamic_cast<const IndustryPackError*>(&error);
  if (known == nullptr) return false;
  const auto status = known->status();
  return status == IndustryPackStatus::badAddress || status == IndustryPackStatus::badIntLevel ||
         status == IndustryPackStatus::notImplemented;
}

IndustryPackModule& Hardware::openNow(const ModulePlace& place, const ModuleKind& kind,
                                      const MakeModel& makeModel, const ServerLog& log) {
  createCarrierOf(place, log);
  plugModel(place, makeModel);
  auto& module = modules_.create(place.name, place.carrier, place.site, kind);
  for (const int line : {0, 1}) module.interrupt(line).setPriority(priority_);
  return module;
}

const std::string& Hardware::kindOf(const std::string& carrier) const {
  const auto kind = kinds_.find(carrier);
  if (kind == kinds_.end()) throw std::invalid_argument(unknownCarrier(carrier));
  return kind->second;
}

void Hardware::check(const ModulePlace& place) const {
  const auto sites = checkCarrier(kindOf(place.carrier));
  for (std::size_t i = 0; i < sites; ++i)
    if (siteName(i) == place.site) return;
  throw std::invalid_argument(fmt::format(R"(site: carrier "{}" has no "{}"; it has {} to {})",
                                          place.carrier, place.site, siteName(0),
                                          siteName(sites - 1)));
}

void Hardware::logPriority(const ServerLog& log) const {
  if (priority_ == 0) {
    log->info("interrupts are served at ordinary priority (--real-time 0)");
  } else if (RealTimePriority::isAllowed(priority_)) {
    log->info("interrupts are served at real-time priority {}", priority_);
  } else {
    log->info(
        "interrupts are served at ordinary priority: this user may not have real-time priority {}; "
        "`mpf doctor` shows how to allow it",
        priority_);
  }
}

void Hardware::createCarrierOf(const ModulePlace& place, const ServerLog& log) {
  const auto names = carriers_.names();
  if (std::find(names.begin(), names.end(), place.carrier) != names.end()) return;
  const auto& text = kindOf(place.carrier);
  const auto colon = text.find(':');
  carriers_.add(place.carrier,
                createCarrier(text.substr(0, colon),
                              colon == std::string::npos ? std::string() : text.substr(colon + 1)));
  const auto& carrier = carriers_.find(place.carrier);
  log->info("carrier {} is {}", place.carrier, carrier.description());
  if (const auto remark = carrier.remark(); !remark.empty())
    log->warn("carrier {}: {}", place.carrier, remark);
}

void Hardware::plugModel(const ModulePlace& place, const MakeModel& makeModel) {
  auto* const carrier = dynamic_cast<ModelCarrier*>(&carriers_.find(place.carrier));
  if (carrier != nullptr && modules_.find(place.carrier, place.site) == nullptr)
    carrier->plug(place.site, makeModel());
}

int runServer(MessageServer& server, const IndustryPackModule& module, const ServerLog& log) {
  logShortages(server, *log);
  log->info(R"(serving the {} at {} as "{}" at location {})", module.kind().name, module.where(),
            server.getName(), server.location());
  const auto status = server.runUntilSignal();
  log->info("stopped");
  return status;
}

}  // namespace mpf
