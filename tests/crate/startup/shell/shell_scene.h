// SPDX-License-Identifier: MIT
// ShellScene: a shell in a temporary folder, with a handler that records its commands as text.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "crate/startup/shell/startup_shell.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {

class ShellScene final : public startup::CommandHandler {
 public:
  // Writes a file and executes it.
  void run(const std::string& text, const std::string& name = "st.cmd") {
    shell.execute(std::filesystem::path(folder.write(name, text)).filename());
  }

  // "name(arguments)"; its result is a handle with its name. Names that begin with "unknown" are
  // unknown.
  std::optional<startup::Value> tryExecute(const startup::Command& command,
                                           startup::StartupShell& /*shell*/) override {
    if (command.name.starts_with("unknown")) return std::nullopt;
    std::string text;
    for (const auto& argument : command.arguments)
      text += (text.empty() ? "" : ", ") + argument.value.description();
    calls.push_back(command.name + "(" + text + ")");
    last = command;
    return command.name == "seven" ? startup::Value::ofInteger(7)
                                   : startup::Value::ofOpaque(command.name);
  }

  // "LINE:COLUMN severity text" of each diagnostic.
  [[nodiscard]] std::vector<std::string> reports() const {
    std::vector<std::string> texts;
    for (const auto& diagnostic : shell.diagnostics().all()) {
      static constexpr const char* kNames[] = {" note ", " warning ", " error "};
      texts.push_back(std::to_string(diagnostic.place.line) + ":" +
                      std::to_string(diagnostic.place.column) +
                      kNames[static_cast<int>(diagnostic.severity)] + diagnostic.text);
    }
    return texts;
  }

  TemporaryFolder folder;
  std::vector<std::string> calls;
  startup::Command last;
  startup::StartupShell shell{*this, folder.path()};
};

using Texts = std::vector<std::string>;

}  // namespace mpf::test
