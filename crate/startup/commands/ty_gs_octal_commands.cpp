// SPDX-License-Identifier: MIT
// Commands of tyGSOctal, the driver of serial modules that MPF R2 uses on vxWorks. Its devices
// become ports under the names that initTtyVxPort() gives them.
//
//   uart = tyGSOctalModuleInit("GSIP_OCTAL232", 0x80, 0, 0)    module
//   tty = tyGSOctalDevCreate("/tyGS/0/0", uart, 0, 1000, 1000) port, known as "/tyGS/0/0"
//   tyGSOctalConfig(tty, 9600, 'N', 1, 8, 'N')                 its settings
//   initTtyVxPort("UART[0]", "/tyGS/0/0", 9600, 1000)          the same port as "UART[0]"
#include <fmt/format.h>

#include "crate/startup/commands/command_table.h"

namespace mpf::startup {
namespace {

struct DeviceHandle {
  std::string name;
};

Value moduleInit(CommandCall& call, StartupSite& site) {
  SerialModule module;
  static_cast<void>(call.text(0, "type"));  // checked, but all modules are of one type
  module.vector = call.integer(1, "interrupt vector", 0, 255);
  const auto where = readSite(call, 2, site.boards);
  module.carrier = where.carrier;
  module.site = where.site;
  module.name = fmt::format("octal-{}-{}", where.carrier, where.site);
  module.place = call.place();
  module.source = call.source();
  const auto name = module.name;
  if (call.isValid() && !site.serialLines.addModule(std::move(module)))
    call.refuse(3, fmt::format("the module at {} of carrier \"{}\" exists already", where.site,
                               where.carrier));
  return call.isValid() ? Value::ofOpaque(ModuleHandle{name}) : Value::unavailable();
}

// Adds the port `number` of the module in the argument `index`.
void addPort(CommandCall& call, StartupSite& site, std::size_t index, const std::string& name,
             const LineSettings& settings) {
  const auto value = call.value(index);
  const auto* const module = value.opaque<ModuleHandle>();
  if (module == nullptr && call.isValid())
    call.refuse(index,
                fmt::format("{} is not the result of tyGSOctalModuleInit", value.description()));
  const auto number = call.integer(index + 1, "number of the port", 0, 7);
  if (module != nullptr) checkPortIsFree(call, index + 1, site, module->name, number);
  if (!call.isValid()) return;
  if (!site.serialLines.addPort(
          {name, module->name, number, "", settings, call.place(), call.source()}))
    call.refuse(0, fmt::format("the device \"{}\" exists already", name));
}

Value devCreate(CommandCall& call, StartupSite& site) {
  const auto name = call.name(0, "name of the device");
  addPort(call, site, 1, name, {});
  return call.isValid() ? Value::ofOpaque(DeviceHandle{name}) : Value::unavailable();
}

Value config(CommandCall& call, StartupSite& site) {
  const auto value = call.value(0);
  const auto* const device = value.opaque<DeviceHandle>();
  if (device == nullptr)
    call.refuse(0, fmt::format("{} is not the result of tyGSOctalDevCreate", value.description()));
  const auto settings = readOctalSettings(call, 1);
  if (!call.isValid()) return Value::unavailable();
  site.serialLines.findPort(device->name)->settings = settings;
  return Value();
}

// initTtyVxPort("port", "/tyGS/0/0", baud, bufSize)
Value initTtyVxPort(CommandCall& call, StartupSite& site) {
  const auto name = call.name(0, "port");
  const auto device = call.name(1, "device");
  const auto baud = call.integer(2, "baud", 1, 4'000'000);
  checkOctalBaud(call, 2, baud);
  if (!call.isValid()) return Value::unavailable();
  auto* const port = site.serialLines.findPort(device);
  if (port == nullptr) {
    call.refuse(1, fmt::format("there is no device \"{}\"; tyGSOctalDevCreate(\"{}\", ...) must "
                               "come before this line",
                               device, device));
    return Value::unavailable();
  }
  port->settings.baud = baud;
  if (!site.serialLines.addAlias(name, device)) {
    call.refuse(0, fmt::format("the port \"{}\" exists already", name));
    return Value::unavailable();
  }
  return Value();
}

// tyGSMPFInit("server", uart, port, baud, 'N', stop, bits, 'N', "eom"): all of the above, and a
// server.
Value mpfInit(CommandCall& call, StartupSite& site) {
  const auto name = call.name(0, "server");
  const auto settings = readOctalSettings(call, 3);
  addPort(call, site, 1, name, settings);
  SerialServer server{name, name,         1000,         50, readEndOfMessage(call, 8),
                      true, call.place(), call.source()};
  if (!call.isValid()) return Value::unavailable();
  site.serialLines.addServer(std::move(server));
  return Value();
}

// tyGSOctalDrv(modules): the number of modules, which MPF need not know.
Value driver(CommandCall& /*call*/, StartupSite& /*site*/) { return Value(); }

constexpr CommandEntry kTyGsOctalCommands[] = {
    {"tyGSOctalDrv", driver},          {"tyGSOctalModuleInit", moduleInit},
    {"tyGSOctalDevCreate", devCreate}, {"tyGSOctalConfig", config},
    {"initTtyVxPort", initTtyVxPort},  {"tyGSMPFInit", mpfInit},
};

}  // namespace

std::span<const CommandEntry> tyGsOctalCommands() { return kTyGsOctalCommands; }

}  // namespace mpf::startup
