// SPDX-License-Identifier: MIT
// Executes one line in the iocsh dialect, whose macros are already replaced. The grammar is in
// startup_shell.h.
//
// Threads  one.
// Trust    any bytes; a line that is wrong throws LineError and executes nothing.
#pragma once

#include <string_view>

#include "crate/startup/shell/line_actions.h"

namespace mpf::startup {

void executeIocshLine(std::string_view line, LineActions& actions);

}  // namespace mpf::startup
