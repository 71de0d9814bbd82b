// SPDX-License-Identifier: MIT
// Commands of carriers.
#include <fmt/format.h>

#include "crate/startup/commands/command_table.h"
#include "drivers/industry_pack/carrier_parameters.h"

namespace mpf::startup {
namespace {

// Adds a board after its parameters have been checked. Returns its number.
Value addBoard(CommandCall& call, StartupSite& site, const std::string& kind,
               std::size_t parametersAt) {
  const auto parameters = call.textOr(parametersAt, "parameters", "");
  try {
    static_cast<void>(parseCarrierParameters(kind, parameters));
  } catch (const std::exception& error) {
    call.refuse(parametersAt, error.what());
    return Value::unavailable();
  }
  const auto number = site.boards.add(
      {parameters.empty() ? kind : kind + ":" + parameters, call.place(), call.source()});
  return Value::ofInteger(static_cast<std::int64_t>(number));
}

Value ipacAddCarrier(CommandCall& call, StartupSite& site) {
  const auto type = call.value(0);
  if (type.integer() == 0) {  // NULL: reserves the number
    site.boards.add({"", call.place(), call.source()});
    return Value();
  }
  const bool isSymbol = type.is(Value::Kind::address) || type.is(Value::Kind::undefined);
  if (!isSymbol || !isParameterKind(type.name())) {
    call.refuse(0,
                fmt::format("{} is not a type of carrier; write &vipc616_01, &ipmv162 or another "
                            "symbol of drvIpac",
                            type.description()));
    return Value::unavailable();
  }
  return addBoard(call, site, type.name(), 1).is(Value::Kind::unavailable) ? Value::unavailable()
                                                                           : Value();
}

// ipacAddVIPC616_01("0x3000,0xa0000000") and the like, which return the number.
Value ipacAddBoard(CommandCall& call, StartupSite& site) {
  return addBoard(call, site, call.commandName(), 0);
}

Value initIpacCarrier(CommandCall& call, StartupSite& site) {
  const auto name = call.name(0, "name of the carrier");
  const auto number = call.integer(1, "number of the carrier", 0, 20);
  if (!call.isValid()) return Value::unavailable();
  if (!site.boards.has(static_cast<std::size_t>(number)))
    call.refuse(1, fmt::format("there is no carrier {}; {} were added by ipacAddCarrier before "
                               "this line",
                               number, site.boards.size()));
  else if (name.find('=') != std::string::npos || name.find(':') != std::string::npos)
    call.refuse(0,
                fmt::format("the name \"{}\" contains = or :, which --carrier cannot take", name));
  else if (!site.boards.giveName(name, static_cast<std::size_t>(number)))
    call.refuse(0, fmt::format("the name \"{}\" belongs to another carrier", name));
  return call.isValid() ? Value() : Value::unavailable();
}

constexpr CommandEntry kCarrierCommands[] = {
    {"ipacAddCarrier", ipacAddCarrier},  {"initIpacCarrier", initIpacCarrier},
    {"ipacAddVIPC310", ipacAddBoard},    {"ipacAddVIPC610", ipacAddBoard},
    {"ipacAddVIPC610_01", ipacAddBoard}, {"ipacAddVIPC616", ipacAddBoard},
    {"ipacAddVIPC616_01", ipacAddBoard}, {"ipacAddMVME162", ipacAddBoard},
    {"ipacAddTVME200", ipacAddBoard},    {"ipacAddHy8002", ipacAddBoard},
    {"ipacAddXy9660", ipacAddBoard},     {"ipacAddAvme96XX", ipacAddBoard},
    {"ipacAddATC40", ipacAddBoard},
};

}  // namespace

std::span<const CommandEntry> carrierCommands() { return kCarrierCommands; }

SiteArguments readSite(CommandCall& call, std::size_t index, Boards& boards) {
  if (const auto number = call.value(index).integer(); number && call.has(index)) {
    if (*number < 0 || !boards.has(static_cast<std::size_t>(*number))) {
      call.refuse(index, fmt::format("there is no carrier {}; {} were added before this line",
                                     *number, boards.size()));
      return {};
    }
    const auto slot = call.integer(index + 1, "slot", 0, 5);
    return {boards.nameOf(static_cast<std::size_t>(*number)),
            fmt::format("IP_{}", static_cast<char>('a' + slot))};
  }
  SiteArguments where{call.name(index, "carrier"), call.name(index + 1, "site")};
  if (call.isValid() && !boards.hasName(where.carrier))
    call.refuse(index, fmt::format("there is no carrier \"{}\"; name it before this line: "
                                   "initIpacCarrier(\"{}\", 0)",
                                   where.carrier, where.carrier));
  if (call.isValid() && (where.site.size() != 4 || !where.site.starts_with("IP_") ||
                         where.site[3] < 'a' || where.site[3] > 'f'))
    call.refuse(index + 1, fmt::format("site \"{}\"; write IP_a to IP_f", where.site));
  return where;
}

}  // namespace mpf::startup
