// SPDX-License-Identifier: MIT
#include "crate/startup/commands/command_table.h"

#include <algorithm>
#include <array>

namespace mpf::startup {

const CommandEntry* findCommand(std::string_view name) {
  for (const auto commands :
       {carrierCommands(), serialCommands(), tyGsOctalCommands(), moduleCommands(), gpibCommands(),
        ip330Commands(), routerCommands(), iocCommands(), otherCommands()}) {
    const auto found = std::ranges::find(commands, name, &CommandEntry::name);
    if (found != commands.end()) return &*found;
  }
  return nullptr;
}

}  // namespace mpf::startup
