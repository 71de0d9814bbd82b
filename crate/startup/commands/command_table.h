// SPDX-License-Identifier: MIT
// The commands of MPF in startup files, and what each of them does.
//
// Threads  constant data.
#pragma once

#include <span>
#include <string_view>

#include "crate/startup/commands/command_call.h"
#include "crate/startup/commands/startup_site.h"

namespace mpf::startup {

struct CommandEntry {
  std::string_view name;
  // Returns the result of the command, or Value::unavailable() after an error.
  Value (*execute)(CommandCall& call, StartupSite& site);
};

std::span<const CommandEntry> carrierCommands();  // ipacAddCarrier, initIpacCarrier, ...
std::span<const CommandEntry>
serialCommands();  // initOctalUART, initSerialServer, initTtyPort, ...
std::span<const CommandEntry> tyGsOctalCommands();  // tyGSOctalModuleInit, ...
std::span<const CommandEntry> moduleCommands();  // initDAC128V, initIpUnidig
std::span<const CommandEntry> gpibCommands();  // initGpibGsTi9914, initGpibServer, ...
std::span<const CommandEntry> ip330Commands();  // initIp330, initIp330Scan, ...
std::span<const CommandEntry> routerCommands();  // routerInit, localMessageRouterStart, ...
std::span<const CommandEntry> iocCommands();  // dbLoadRecords, iocInit, ...
std::span<const CommandEntry> otherCommands();  // what MPF does not do, and why

// nullptr: there is no such command.
[[nodiscard]] const CommandEntry* findCommand(std::string_view name);

// The carrier and the site of a module, as two arguments of a command.
struct SiteArguments {
  std::string carrier, site;
};
// Reads ("ipac", "IP_a"), or the numbers of MPF R2: (0, 2) is IP_c of board 0.
[[nodiscard]] SiteArguments readSite(CommandCall& call, std::size_t index, Boards& boards);

// Reads the settings of a serial line: 9600, "N", 1, 8, "N". Missing ones have their defaults.
[[nodiscard]] LineSettings readLineSettings(CommandCall& call, std::size_t index);
// The same for a port of an octal UART, whose chip has few speeds.
[[nodiscard]] LineSettings readOctalSettings(CommandCall& call, std::size_t index);
// Refuses a speed that this chip does not have.
void checkOctalBaud(CommandCall& call, std::size_t index, std::int64_t baud);
// Refuses a port of a module that has another name already.
//   index  the argument with the number of the port
void checkPortIsFree(CommandCall& call, std::size_t index, const StartupSite& site,
                     const std::string& module, std::int64_t number);
// Reads the end of message: 0 to 2 bytes, with escapes.
[[nodiscard]] std::string readEndOfMessage(CommandCall& call, std::size_t index);

}  // namespace mpf::startup
