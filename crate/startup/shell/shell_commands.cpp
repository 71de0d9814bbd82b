// SPDX-License-Identifier: MIT
#include "crate/startup/shell/shell_commands.h"

#include <fmt/format.h>
#include <string>
#include <system_error>
#include <utility>

#include "crate/startup/shell/line_error.h"
#include "crate/startup/shell/string_argument.h"

namespace mpf::startup {
namespace {

// A folder of the site that does not exist here does not stop the file: what follows is then
// looked up where the shell is.
void changeFolder(const Command& command, ShellState& state, LineActions& actions) {
  const auto folder = command.argument(0);
  if (folder.is(Value::Kind::undefined))
    return actions.report(
        Severity::warning, columnOf(command, 0),
        fmt::format("undefined symbol {}; the current folder is still {}: define {} as the site's "
                    "cdCommands does",
                    folder.name(), state.folder.string(), folder.name()));
  const auto text = command.arguments.empty() ? "" : textOf(command, 0);
  if (text.empty()) {
    state.folder = state.startFolder;
    return;
  }
  auto target = (state.folder / text).lexically_normal();
  std::error_code error;
  if (std::filesystem::is_directory(target, error)) {
    state.folder = std::move(target);
    return;
  }
  actions.report(Severity::warning, columnOf(command, 0),
                 fmt::format("the folder {} does not exist; the current folder is still {}",
                             target.string(), state.folder.string()));
}

void setVariable(const Command& command, ShellState& state) {
  if (command.arguments.size() < 2) return;  // shows it
  state.symbols[textOf(command, 0)] = command.argument(1);
}

void putEnvironment(const Command& command, ShellState& state) {
  const auto text = textOf(command, 0);
  const auto equals = text.find('=');
  if (equals == std::string::npos)
    throw LineError{columnOf(command, 0), "putenv: \"NAME=VALUE\" is expected"};
  state.environment[text.substr(0, equals)] = text.substr(equals + 1);
}

}  // namespace

std::optional<Value> tryShellCommand(const Command& command, ShellState& state,
                                     LineActions& actions) {
  const auto& name = command.name;
  if (name == "cd" || name == "chdir") changeFolder(command, state, actions);
  else if (name == "putenv") putEnvironment(command, state);
  else if (name == "epicsEnvSet") state.environment[textOf(command, 0)] = textOf(command, 1);
  else if (name == "var") setVariable(command, state);
  else if (name == "iocsh" || name == "iocshLoad")
    actions.include(textOf(command, 0), command.place.column);
  else if (name != "pwd" && name != "epicsEnvShow") return std::nullopt;
  return Value();
}

}  // namespace mpf::startup
