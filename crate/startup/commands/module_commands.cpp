// SPDX-License-Identifier: MIT
// Commands of the modules with one server process: DAC128V and digital I/O.
#include <fmt/format.h>

#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"

namespace mpf::startup {
namespace {

Value addModule(CommandCall& call, StartupSite& site, const std::string& kind) {
  const auto name = call.name(0, "module");
  const auto where = readSite(call, 1, site.boards);
  auto process = newProcess(kind, name, call.place(), call.source());
  addValue(process, "module", name, call.place());
  addValue(process, "carrier", where.carrier, call.place());
  addValue(process, "site", where.site, call.place());
  if (call.isValid() && site.findModule(kind, name) != nullptr)
    call.refuse(0, fmt::format("the module \"{}\" exists already", name));
  if (!call.isValid()) return Value::unavailable();
  site.modules.push_back(std::move(process));
  return Value::ofOpaque(ModuleHandle{name});
}

// Adds the integer arguments from `first` on that were written.
void addIntegers(CommandCall& call, crate::Process& process, std::size_t first,
                 std::initializer_list<const char*> keys, std::int64_t most) {
  for (const auto* const key : keys) {
    if (!call.has(first)) return;
    addValue(process, key, fmt::to_string(call.integer(first, key, 0, most)), call.place());
    ++first;
  }
}

// initDAC128V("module", "carrier", "site", queueSize)
Value initDac128v(CommandCall& call, StartupSite& site) {
  auto handle = addModule(call, site, "dac128v");
  if (call.isValid()) addIntegers(call, site.modules.back(), 3, {"queuesize"}, 10'000);
  return call.isValid() ? handle : Value::unavailable();
}

// initIpUnidig("module", "carrier", "site", queueSize[, msecPoll, intVec, risingMask, fallingMask,
// biMask, maxClients])
Value initIpUnidig(CommandCall& call, StartupSite& site) {
  auto handle = addModule(call, site, "digital-io");
  if (call.isValid())
    addIntegers(
        call, site.modules.back(), 3,
        {"queuesize", "mspoll", "intvec", "risingmask", "fallingmask", "bimask", "maxclients"},
        0xffffffff);
  return call.isValid() ? handle : Value::unavailable();
}

constexpr CommandEntry kModuleCommands[] = {{"initDAC128V", initDac128v},
                                            {"initIpUnidig", initIpUnidig}};

}  // namespace

std::span<const CommandEntry> moduleCommands() { return kModuleCommands; }

}  // namespace mpf::startup
