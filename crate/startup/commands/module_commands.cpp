// SPDX-License-Identifier: MIT
// Commands of the modules with one server process: DAC128V and digital I/O.
#include <cstdint>
#include <fmt/format.h>
#include <initializer_list>
#include <limits>

#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"

namespace mpf::startup {
namespace {

struct IntegerArgument {
  const char* key;
  std::int64_t most;
};

// Adds the integer arguments after the site that were written: queueSize, and `others`.
void addIntegers(CommandCall& call, crate::Process& process,
                 std::initializer_list<IntegerArgument> others) {
  constexpr std::size_t kFirst = 3;
  constexpr std::int64_t kDefaultQueueSize = 20;  // as that of the programs
  auto index = kFirst;
  const auto add = [&](const char* key, std::int64_t value) {
    addValue(process, key, fmt::to_string(value), call.place());
  };
  if (!call.has(index)) return;
  const auto queueSize = call.queueSize(index);
  add("queuesize", queueSize == 0 ? kDefaultQueueSize : queueSize);
  for (const auto& argument : others) {
    if (!call.has(++index)) return;
    add(argument.key, call.integer(index, argument.key, 0, argument.most));
  }
}

Value addModule(CommandCall& call, StartupSite& site, const std::string& kind,
                std::initializer_list<IntegerArgument> others) {
  const auto name = call.name(0, "module");
  const auto where = readSite(call, 1, site.boards);
  auto process = newProcess(kind, name, call.place(), call.source());
  addValue(process, "module", name, call.place());
  addValue(process, "carrier", where.carrier, call.place());
  addValue(process, "site", where.site, call.place());
  addIntegers(call, process, others);
  if (call.isValid() && site.findModule(kind, name) != nullptr)
    call.refuse(0, fmt::format("the module \"{}\" exists already", name));
  if (!call.isValid()) return Value::unavailable();
  site.modules.push_back(std::move(process));
  return Value::ofOpaque(ModuleHandle{name});
}

// initDAC128V("module", "carrier", "site", queueSize)
Value initDac128v(CommandCall& call, StartupSite& site) {
  return addModule(call, site, "dac128v", {});
}

// initIpUnidig("module", "carrier", "site", queueSize[, msecPoll, intVec, risingMask, fallingMask,
// biMask, maxClients])
Value initIpUnidig(CommandCall& call, StartupSite& site) {
  constexpr std::int64_t kLongestPollMs = 3'600'000;
  constexpr std::int64_t kAllBits = 0xffff'ffff;
  return addModule(call, site, "digital-io",
                   {{"mspoll", kLongestPollMs},
                    {"intvec", 255},
                    {"risingmask", kAllBits},
                    {"fallingmask", kAllBits},
                    {"bimask", kAllBits},
                    {"maxclients", std::numeric_limits<std::int32_t>::max()}});
}

constexpr CommandEntry kModuleCommands[] = {{"initDAC128V", initDac128v},
                                            {"initIpUnidig", initIpUnidig}};

}  // namespace

std::span<const CommandEntry> moduleCommands() { return kModuleCommands; }

}  // namespace mpf::startup
