// SPDX-License-Identifier: MIT
// Commands of GPIB: modules, their servers, and the links of the IOC.
//
//   initGpibGsTi9914("GS-IP488-0", carrier, "IP_c", 104)     module ─┐ one process; without a server
//   initGpibServer("GPIB0", "GS-IP488-0", 1024, 1000)        server ─┘ its name is that of the module
//   HiDEOSGpibLinkConfig(10, 1, "GPIB0")                     remote: a server at location 1
//   HiDEOSGpibLinkConfig(10, 0, "GS-IP488-0")                local: a module of this file
#include <fmt/format.h>

#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"

namespace mpf::startup {
namespace {

constexpr std::int64_t kMaxGpibBuffer = 16 << 20;

// initGpibGsTi9914("module", "carrier", "site", intVec)
Value initGpibModule(CommandCall& call, StartupSite& site) {
  const auto name = call.name(0, "module");
  const auto where = readSite(call, 1, site.boards);
  const auto vector = call.has(3) ? call.integer(3, "intVec", 0, 255) : 0;
  if (call.isValid() && site.findModule("gpib", name) != nullptr)
    call.refuse(0, fmt::format("the module \"{}\" exists already", name));
  if (!call.isValid()) return Value::unavailable();
  auto process = newProcess("gpib", name, call.place(), call.source());
  addValue(process, "server", name, call.place());
  addValue(process, "module", name, call.place());
  auto module = fmt::format("{},{},{}", name, where.carrier, where.site);
  if (vector != 0) module += fmt::format(",{}", vector);
  addValue(process, "ti9914", module, call.place());
  site.modules.push_back(std::move(process));
  return Value::ofOpaque(ModuleHandle{name});
}

// initGpibServer("server", "module", bufferSize, queueSize)
Value initGpibServer(CommandCall& call, StartupSite& site) {
  const auto server = call.name(0, "server");
  const auto module = call.name(1, "module");
  auto* const process = site.findModule("gpib", module);
  if (call.isValid() && process == nullptr)
    call.refuse(1, fmt::format("the module \"{}\" does not exist at this line", module));
  else if (call.isValid() && process->find("bufsize") != nullptr)
    call.refuse(1, fmt::format(R"(the module "{}" has the server "{}" already)", module,
                               process->valueOf("server")));
  const auto bufferSize = call.integer(2, "bufferSize", 0, kMaxGpibBuffer);
  const auto queueSize = call.queueSize(3);
  if (!call.isValid()) return Value::unavailable();
  setValue(*process, "server", server, call.place());
  setValue(*process, "bufsize", fmt::to_string(bufferSize == 0 ? 1024 : bufferSize), call.place());
  if (queueSize != 0) setValue(*process, "queuesize", fmt::to_string(queueSize), call.place());
  return Value();
}

// HiDEOSGpibLinkConfig(link, boardId, "name")
Value configureLink(CommandCall& call, StartupSite& site) {
  const auto link = call.integer(0, "link", 0, 32'767);
  const auto board = call.integer(1, "boardId", 0, 0x7fff'ffff);
  const auto name = call.name(2, "name");
  if (!call.isValid()) return Value::unavailable();
  const auto* const module = site.findModule("gpib", name);
  const auto here = site.location.value_or(0);
  const auto location = module == nullptr ? board : here;
  if (location != board)
    call.warn(
        fmt::format("HiDEOSGpibLinkConfig: boardId {} is ignored, because \"{}\" is a module "
                    "of this file, at location {}; for a server at location {} give the "
                    "module another name",
                    board, name, here, board));
  site.ioc.add("HiDEOSGpibLinkConfig",
               {fmt::to_string(link), fmt::to_string(location),
                module == nullptr ? name : module->valueOf("server")},
               call.source());
  return Value();
}

// gpibSniff("module", seconds): prints the bytes of a bus for a time.
Value gpibSniff(CommandCall& call, StartupSite& site) {
  const auto name = call.name(0, "module");
  const auto seconds = call.integer(1, "seconds", 0, 1'000'000'000);
  const auto* const module = site.findModule("gpib", name);
  if (call.isValid() && module == nullptr)
    call.refuse(0, fmt::format("the module \"{}\" does not exist at this line", name));
  if (!call.isValid()) return Value::unavailable();
  auto sniffer = newProcess("", "sniff-" + name, call.place(), call.source());
  sniffer.command = {"mpf", "gpib-sniff", module->valueOf("server"), fmt::to_string(seconds)};
  sniffer.needs = {module->valueOf("server")};
  sniffer.supervision.restart = crate::Restart::never;
  site.sniffers.push_back(std::move(sniffer));
  return Value();
}

constexpr CommandEntry kGpibCommands[] = {{"initGpibGsTi9914", initGpibModule},
                                          {"initGpibServer", initGpibServer},
                                          {"HiDEOSGpibLinkConfig", configureLink},
                                          {"gpibSniff", gpibSniff}};

}  // namespace

std::span<const CommandEntry> gpibCommands() { return kGpibCommands; }

}  // namespace mpf::startup
