// SPDX-License-Identifier: MIT
// malloc(), calloc(), free(), strcpy(), strcat(), strlen() and sprintf() of startup files, which
// build macro strings with them that are longer than a line may be.
//
// Threads  one.
// Trust    malloc() allocates nothing; the bytes of one string and of all are limited.
#pragma once

#include <optional>

#include "crate/startup/shell/line_actions.h"
#include "crate/startup/shell/shell_state.h"

namespace mpf::startup {

//   returns  nullopt: `command` is no such function
//   throws   LineError about an argument
[[nodiscard]] std::optional<Value> tryStringFunction(const Command& command, ShellState& state,
                                                     LineActions& actions);

}  // namespace mpf::startup
