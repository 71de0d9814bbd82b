// SPDX-License-Identifier: MIT
// Functions that build a crate::Process from commands of a startup file.
//
// Threads  any.
#pragma once

#include <string>

#include "crate/config/crate.h"

namespace mpf::startup {

// `name` without characters that a name of a process must not have.
[[nodiscard]] std::string processName(const std::string& name);

//   kind    of programKinds(); empty: a program with a command
//   place   "FILE:LINE:COLUMN" of the command
//   source  the line, for comments
[[nodiscard]] crate::Process newProcess(const std::string& kind, const std::string& name,
                                        const std::string& place, const std::string& source);

// Adds a value to a setting, which is created if the process has none with this key.
void addValue(crate::Process& process, const std::string& key, const std::string& value,
              const std::string& place);
// Replaces the value of a setting.
void setValue(crate::Process& process, const std::string& key, const std::string& value,
              const std::string& place);

}  // namespace mpf::startup
