// SPDX-License-Identifier: MIT
// The commands of the shell that change its folder, environment and variables: cd, pwd, putenv,
// epicsEnvSet, epicsEnvShow, var, iocsh and iocshLoad.
//
// Threads  one.
#pragma once

#include <optional>

#include "crate/startup/shell/line_actions.h"
#include "crate/startup/shell/shell_state.h"

namespace mpf::startup {

//   returns  nullopt: `command` is no such command
//   throws   LineError about an argument
[[nodiscard]] std::optional<Value> tryShellCommand(const Command& command, ShellState& state,
                                                   LineActions& actions);

}  // namespace mpf::startup
