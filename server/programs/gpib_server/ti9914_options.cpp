// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/ti9914_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>

#include "drivers/gpib/bus_model.h"
#include "drivers/gpib/meter_model.h"
#include "drivers/ti9914/ti9914_controller.h"
#include "drivers/ti9914/ti9914_model.h"
#include "server/programs/hardware/option_fields.h"

namespace mpf {
namespace {

Ti9914Start readModule(OptionFields& fields) {
  Ti9914Start module;
  module.place.name = fields.word("module");
  module.place.carrier = fields.word("carrier");
  module.place.site = fields.word("site");
  const int vector = fields.number("vector", -1);
  if (vector != -1) module.vector = vector;
  return module;
}

MeterStart readMeter(OptionFields& fields) {
  const int number = fields.number("address");
  const auto address = GpibAddress::fromNumber(number);
  if (!address)
    fields.complain(fmt::format(
        "{} is not a GPIB address: use 0 to 30, or 100 * primary + secondary address", number));
  return {*address, fields.word("wire", "")};
}

MeterModel::Volts voltsOf(const MeterStart& meter, Hardware& hardware) {
  if (meter.wire.empty()) return MeterModel::manualReadings();
  if (hardware.wires() == nullptr)
    throw std::invalid_argument(
        fmt::format("the meter at {} measures wire \"{}\": use --wires FILE",
                    toString(meter.address), meter.wire));
  return [wire = hardware.wires()->wire(meter.wire)] { return wire.get(); };
}

std::unique_ptr<DeviceModel> makeModel(const Ti9914Options& options, const Ti9914Start& start,
                                       Hardware& hardware, const ServerLog& log) {
  auto bus = std::make_shared<GpibBusModel>();
  auto meters = options.meters;
  if (meters.empty()) meters.push_back({{MeterModel::kUsualAddress}, {}});
  for (const auto& meter : meters) {
    bus->attach(meter.address, std::make_shared<MeterModel>(voltsOf(meter, hardware)));
    log->info("{} is a model: a meter is at address {} of its bus", start.place.name,
              toString(meter.address));
  }
  return std::make_unique<Ti9914Model>(std::move(bus));
}

}  // namespace

void Ti9914Options::addTo(CLI::App& app) {
  addFields(app, "--ti9914", "MODULE,CARRIER,SITE[,VECTOR]",
            "A GPIB controller on an Industry Pack module, GreenSpring IP-488",
            [this](OptionFields& fields) { modules.push_back(readModule(fields)); });
  addFields(app, "--meter", "ADDRESS[,WIRE]",
            "On a model carrier: a voltmeter like the HP 3458A, which measures a wire of --wires; "
            "default: one at 22, with simulated values",
            [this](OptionFields& fields) { meters.push_back(readMeter(fields)); });
}

const Ti9914Start* Ti9914Options::find(const std::string& module) const {
  const auto found =
      std::ranges::find(modules, module, [](const Ti9914Start& start) { return start.place.name; });
  return found == modules.end() ? nullptr : &*found;
}

std::unique_ptr<GpibController> openTi9914(const Ti9914Options& options, const Ti9914Start& start,
                                           Hardware& hardware, const ServerLog& log,
                                           StopBell& stop) {
  auto* const module = hardware.open(
      start.place, kIp488, [&] { return makeModel(options, start, hardware, log); }, log, stop);
  if (module == nullptr) return nullptr;
  if (start.vector) hardware.modules().takeVector(*start.vector, *module);
  hardware.logPriority(log);
  return std::make_unique<Ti9914Controller>(
      *module,
      Ti9914Chip::Options{.vector = start.vector.value_or(0),
                          .onAlarm = [&log](const std::string& what) { log->warn("{}", what); }});
}

}  // namespace mpf
