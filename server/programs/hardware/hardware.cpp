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

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kLookAgain{500};

std::string notSaid(const std::string& carrier) {
  return fmt::format(
      "nothing says what carrier \"{0}\" is; use --carrier {0}=KIND[:PARAMETERS], of which there "
      "are:\n{1}",
      carrier, carrierKinds());
}

}  // namespace

void ModulePlace::addTo(CLI::App& app, const std::string& aboutName) {
  app.add_option("module", name, aboutName)->required();
  app.add_option("carrier", carrier, "Name of the carrier that it is on")->required();
  app.add_option("site", site, "Its place there: IP_a, IP_b, ...")->required();
}

void Hardware::addTo(CLI::App& app) {
  app.add_option_function<std::vector<std::string>>(
         "--carrier",
         [this](const std::vector<std::string>& options) {
           for (const auto& option : options) {
             const auto equals = option.find('=');
             if (equals == 0 || equals == std::string::npos)
               throw CLI::ValidationError("--carrier",
                                          "\"" + option + "\" is no NAME=KIND[:PARAMETERS]");
             kinds_[option.substr(0, equals)] = option.substr(equals + 1);
           }
         },
         "What a carrier is, NAME=KIND[:PARAMETERS]; kinds:\n" + carrierKinds())
      ->allow_extra_args(false)
      ->type_name("NAME=KIND");
  app.add_flag("--wait", waits_, "Start even if the board is not there, and wait for it");
  app.add_option(
         "--wires", wiresPath_,
         "File by which models of several programs are wired to each other; the first one makes it")
      ->type_name("FILE");
  app.add_option("--real-time", priority_,
                 "Real-time priority of the threads that serve interrupts, where the user may have "
                 "it; 0: none")
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
  static_cast<void>(wires());  // a file that is none of wires is not what to wait for
  for (std::string said;;) {
    try {
      return &openNow(place, kind, makeModel, log);
    } catch (const std::invalid_argument&) {
      throw;  // time does not mend it
    } catch (const std::runtime_error& error) {
      if (!waits_ || isForGood(error)) throw;
      if (std::exchange(said, error.what()) != error.what())
        log->warn("the board is not there yet: {}", error.what());
    }
    if (stop.wait(kLookAgain)) return nullptr;
  }
}

bool Hardware::isForGood(const std::runtime_error& error) {
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

void Hardware::logPriority(const ServerLog& log) const {
  if (priority_ == 0) {
    log->info("interrupts are served at ordinary priority, as --real-time 0 says");
  } else if (RealTimePriority::isAllowed(priority_)) {
    log->info("interrupts are served at real-time priority {}", priority_);
  } else {
    log->info(
        "interrupts are served at ordinary priority: this user may not have real-time priority {}; "
        "mpf doctor says what helps",
        priority_);
  }
}

void Hardware::createCarrierOf(const ModulePlace& place, const ServerLog& log) {
  const auto names = carriers_.names();
  if (std::find(names.begin(), names.end(), place.carrier) != names.end()) return;
  const auto said = kinds_.find(place.carrier);
  if (said == kinds_.end()) throw std::invalid_argument(notSaid(place.carrier));
  const auto& text = said->second;
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
  logShortages(server, log);
  log->info(R"(serving the {} at {} as "{}" at location {})", module.kind().name, module.where(),
            server.getName(), server.location());
  const auto status = server.runUntilSignal();
  log->info("ends");
  return status;
}

}  // namespace mpf
