// SPDX-License-Identifier: MIT
// Commands of the IP330. A server of the module is named by the result of initIp330(), or by the
// name of the module in MPF R2.
#include <algorithm>
#include <fmt/format.h>

#include "base/number.h"
#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"
#include "drivers/ip330/ip330_settings.h"
#include "drivers/ip330/ip330_sweep.h"

namespace mpf::startup {
namespace {

constexpr std::int64_t kMaxMs = 1'000'000;

// The last field of a server; 0 is the default of the program.
std::string readQueueField(CommandCall& call, std::size_t index) {
  const auto size = call.queueSize(index);
  return size == 0 ? "" : fmt::format(",{}", size);
}

// The module of the argument `index`; nullptr, after an error, otherwise.
crate::Process* readModule(CommandCall& call, StartupSite& site, std::size_t index,
                           const std::string& kind, const char* creator) {
  const auto value = call.value(index);
  if (value.is(Value::Kind::unavailable)) {
    call.text(index, "module");  // the error was reported at its command
    return nullptr;
  }
  const auto* const handle = value.opaque<ModuleHandle>();
  const auto name = handle != nullptr ? handle->name : value.text().value_or("");
  if (auto* const module = site.findModule(kind, name)) return module;
  call.refuse(index, fmt::format("{} is not a module of {}, which must come before this line",
                                 value.description(), creator));
  return nullptr;
}

// The number in a setting; `otherwise` when it is absent.
int numberOf(const crate::Process& module, const std::string& key, int otherwise) {
  return tryNumber<int>(module.valueOf(key)).value_or(otherwise);
}

// The settings of a module, as its server will read them.
Ip330Settings settingsOf(const crate::Process& module) {
  Ip330Settings settings;
  settings.type = parseIp330Type(module.valueOf("type"));
  settings.firstChannel = numberOf(module, "first", settings.firstChannel);
  settings.lastChannel = numberOf(module, "last", settings.lastChannel);
  settings.maxClients = numberOf(module, "maxclients", settings.maxClients);
  settings.scanMode =
      parseIp330ScanMode(numberOf(module, "scan-mode", static_cast<int>(settings.scanMode)));
  if (const auto us = tryNumber<int>(module.valueOf("us-per-scan")))
    settings.microsecondsPerScan = *us;
  return settings;
}

// Checks the channels of a server, and whether the module can have one more.
//   index  the argument with the first channel
void checkClient(CommandCall& call, std::size_t index, const crate::Process* module,
                 std::int64_t first, std::int64_t last) {
  if (module == nullptr) return;
  const auto settings = settingsOf(*module);
  const auto problem = settings.problemOfChannels(static_cast<int>(first), static_cast<int>(last));
  if (!problem.empty()) call.refuse(index, problem);
  std::size_t clients = 0;
  for (const auto* const key : {"scan", "sweep", "pid"})
    if (const auto* const servers = module->find(key)) clients += servers->values.size();
  if (clients >= static_cast<std::size_t>(settings.maxClients))
    call.refuse(0, fmt::format("the module \"{}\" has {} servers of scans, sweeps and feedback "
                               "already; its maxClients is {}",
                               module->valueOf("module"), clients, settings.maxClients));
}

// What both forms of the command that creates a module have, in this order.
struct Ip330Module {
  std::string name;
  SiteArguments where;
  char type;
  std::string range;
};

Ip330Module readIp330(CommandCall& call, StartupSite& site) {
  Ip330Module module{call.name(0, "module"), readSite(call, 1, site.boards),
                     call.letter(3, "type", "DS", 'S'), call.textOr(4, "range", "-5to5")};
  const auto& range = module.range;
  if (range != "-5to5" && range != "-10to10" && range != "0to5" && range != "0to10")
    call.refuse(4, fmt::format("range \"{}\"; write -5to5, -10to10, 0to5 or 0to10", range));
  return module;
}

Value addIp330(CommandCall& call, StartupSite& site, const Ip330Module& module, std::int64_t first,
               std::int64_t last, std::int64_t maxClients, std::int64_t vector) {
  const Ip330Settings settings{.type = parseIp330Type(std::string(1, module.type)),
                               .firstChannel = static_cast<int>(first),
                               .lastChannel = static_cast<int>(last)};
  if (const auto problem = settings.problem(); !problem.empty()) call.refuse(5, problem);
  if (call.isValid() && site.findModule("ip330", module.name) != nullptr)
    call.refuse(0, fmt::format("the module \"{}\" exists already", module.name));
  if (!call.isValid()) return Value::unavailable();
  auto process = newProcess("ip330", module.name, call.place(), call.source());
  const auto add = [&](const char* key, const auto& value) {
    addValue(process, key, fmt::format("{}", value), call.place());
  };
  add("module", module.name);
  add("carrier", module.where.carrier);
  add("site", module.where.site);
  add("type", module.type);
  add("range", module.range);
  add("first", first);
  add("last", last);
  add("maxclients", maxClients);
  add("vector", vector);
  site.modules.push_back(std::move(process));
  return Value::ofOpaque(ModuleHandle{module.name});
}

// initIp330("module", "carrier", "site", "type", "range", first, last, maxClients, vector)
Value initIp330(CommandCall& call, StartupSite& site) {
  const auto module = readIp330(call, site);
  const auto first = call.integer(5, "firstChan", 0, 31);
  const auto last = call.integer(6, "lastChan", 0, 31);
  const auto maxClients = call.has(7) ? call.integer(7, "maxClients", 1, 1000) : 10;
  const auto vector = call.integer(8, "interrupt vector", 0, 255);
  return addIp330(call, site, module, first, last, maxClients, vector);
}

void checkPeriod(CommandCall& call, const crate::Process& module, std::int64_t mode,
                 std::int64_t usPerScan) {
  auto settings = settingsOf(module);
  settings.scanMode = parseIp330ScanMode(static_cast<int>(mode));
  if (usPerScan != 0) settings.microsecondsPerScan = static_cast<double>(usPerScan);
  if (const auto problem = settings.problem(); !problem.empty()) call.refuse(3, problem);
}

// configIp330(ip330, scanMode, "Input", usPerScan, secBetweenCal)
Value configIp330(CommandCall& call, StartupSite& site) {
  auto* const module = readModule(call, site, 0, "ip330", "initIp330");
  const auto mode = call.integer(1, "scanMode", 0, 5);
  const auto trigger = call.textOr(2, "trigger", "Input");
  const auto usPerScan = call.integer(3, "usPerScan", 0, 1'000'000'000);
  const auto seconds = call.integer(4, "secBetweenCalibrate", -1, 1'000'000'000);
  if (trigger != "Input" && trigger != "Output")
    call.refuse(2, fmt::format("trigger \"{}\"; write Input or Output", trigger));
  if (module != nullptr) checkPeriod(call, *module, mode, usPerScan);
  if (!call.isValid()) return Value::unavailable();
  setValue(*module, "scan-mode", fmt::to_string(mode), call.place());
  setValue(*module, "trigger", trigger, call.place());
  if (usPerScan != 0) setValue(*module, "us-per-scan", fmt::to_string(usPerScan), call.place());
  setValue(*module, "seconds-between-calibrate", fmt::to_string(seconds), call.place());
  module->comment += "\n" + call.source();
  return Value();
}

// The form of MPF R1-4, which creates the module, too: initIp330Scan("module", "carrier", "site",
// "type", "range", vector, queueSize).
Value initIp330AndScan(CommandCall& call, StartupSite& site) {
  const auto module = readIp330(call, site);
  const auto vector = call.integer(5, "interrupt vector", 0, 255);
  static_cast<void>(call.queueSize(6));
  return addIp330(call, site, module, 0, module.type == 'D' ? 15 : 31, 10, vector);
}

// initIp330Scan(ip330, "server", first, last[, msToAverage], queueSize)
Value initIp330Scan(CommandCall& call, StartupSite& site) {
  if (call.value(0).text() && call.size() == 7) return initIp330AndScan(call, site);
  auto* const module = readModule(call, site, 0, "ip330", "initIp330");
  const auto server = call.name(1, "server");
  const auto first = call.integer(2, "firstChan", 0, 31);
  const auto last = call.integer(3, "lastChan", 0, 31);
  const bool hasMs = call.size() >= 6;
  const auto ms = hasMs ? call.integer(4, "msToAverage", 0, kMaxMs) : 0;
  const auto queue = readQueueField(call, hasMs ? 5 : 4);
  checkClient(call, 2, module, first, last);
  if (!call.isValid()) return Value::unavailable();
  addValue(*module, "scan", fmt::format("{},{},{},{}{}", server, first, last, ms, queue),
           call.place());
  module->comment += "\n" + call.source();
  return Value();
}

// initIp330Config(ip330, "server", queueSize)
Value initIp330Config(CommandCall& call, StartupSite& site) {
  auto* const module = readModule(call, site, 0, "ip330", "initIp330");
  const auto server = call.name(1, "server");
  const auto queue = readQueueField(call, 2);
  if (!call.isValid()) return Value::unavailable();
  addValue(*module, "config", fmt::format("{}{}", server, queue), call.place());
  module->comment += "\n" + call.source();
  return Value();
}

// initIp330Sweep(ip330, "server", first, last, maxPoints, queueSize)
Value initIp330Sweep(CommandCall& call, StartupSite& site) {
  auto* const module = readModule(call, site, 0, "ip330", "initIp330");
  const auto server = call.name(1, "server");
  const auto first = call.integer(2, "firstChan", 0, 31);
  const auto last = call.integer(3, "lastChan", 0, 31);
  const auto points = call.integer(4, "maxPoints", 1, kIp330MostPoints);
  const auto queue = readQueueField(call, 5);
  checkClient(call, 2, module, first, last);
  if (!call.isValid()) return Value::unavailable();
  addValue(*module, "sweep", fmt::format("{},{},{},{}{}", server, first, last, points, queue),
           call.place());
  module->comment += "\n" + call.source();
  return Value();
}

// initIp330PID("server", ip330, adcChannel, dac, dacChannel, queueSize)
Value initIp330Pid(CommandCall& call, StartupSite& site) {
  const auto server = call.name(0, "server");
  auto* const module = readModule(call, site, 1, "ip330", "initIp330");
  const auto channel = call.integer(2, "ADCChannel", 0, 31);
  const auto* const dac = readModule(call, site, 3, "dac128v", "initDAC128V");
  const auto dacChannel = call.integer(4, "DACChannel", 0, 7);
  const auto queue = readQueueField(call, 5);
  checkClient(call, 2, module, channel, channel);
  if (!call.isValid()) return Value::unavailable();
  const auto name = dac->valueOf("module");
  const auto opened = fmt::format("{},{},{}", name, dac->valueOf("carrier"), dac->valueOf("site"));
  if (const auto* const dacs = module->find("dac");
      dacs == nullptr || std::ranges::find(dacs->values, opened) == dacs->values.end())
    addValue(*module, "dac", opened, call.place());
  addValue(*module, "pid", fmt::format("{},{},{},{}{}", server, channel, name, dacChannel, queue),
           call.place());
  module->comment += "\n" + call.source();
  return Value::ofOpaque(ModuleHandle{server});
}

// configIp330PID(pid, KP, KI, KD, us, feedbackOn, low, high) existed until R1-7.
Value configIp330Pid(CommandCall& call, StartupSite& /*site*/) {
  call.skip(Severity::warning, "configIp330PID",
            "clients set the parameters of a feedback, such as the records of ip330_pid.db");
  return Value();
}

constexpr CommandEntry kIp330Commands[] = {
    {"initIp330", initIp330},           {"configIp330", configIp330},
    {"initIp330Scan", initIp330Scan},   {"initIp330Config", initIp330Config},
    {"initIp330Sweep", initIp330Sweep}, {"initIp330PID", initIp330Pid},
    {"configIp330PID", configIp330Pid},
};

}  // namespace

std::span<const CommandEntry> ip330Commands() { return kIp330Commands; }

}  // namespace mpf::startup
