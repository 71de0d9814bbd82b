// SPDX-License-Identifier: MIT
// Arguments of the commands that the shell itself defines.
//
// Threads  any.
#pragma once

#include <fmt/format.h>
#include <string>
#include <utility>

#include "crate/startup/shell/line_error.h"
#include "crate/startup/shell/startup_shell.h"

namespace mpf::startup {

// Where the argument is, or the command if it is missing.
[[nodiscard]] inline std::size_t columnOf(const Command& command, std::size_t index) {
  return index < command.arguments.size() ? command.arguments[index].column : command.place.column;
}

//   throws  LineError when the argument is not a string
[[nodiscard]] inline std::string textOf(const Command& command, std::size_t index) {
  const auto value = command.argument(index);
  if (auto text = value.text()) return *std::move(text);
  const auto column = columnOf(command, index);
  if (value.is(Value::Kind::undefined))
    throw LineError{column, fmt::format("undefined symbol {}: assign a string to it before {}",
                                        value.name(), command.name)};
  throw LineError{
      column, fmt::format("{}: expected a string, found {}", command.name, value.description())};
}

}  // namespace mpf::startup
