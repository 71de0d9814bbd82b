// SPDX-License-Identifier: MIT
// Executes the input as a startup file. The last bit of the length chooses the dialect.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "crate/startup/shell/startup_shell.h"
#include "tests/fuzz/fuzzers.h"

namespace mpf::test {
namespace {

// Results of all kinds, and unknown commands, by the length of the name.
class AnyHandler final : public startup::CommandHandler {
 public:
  std::optional<startup::Value> tryExecute(const startup::Command& command,
                                           startup::StartupShell& shell) override {
    using startup::Value;
    for (std::size_t i = 0; i < command.arguments.size(); ++i)
      shell.reportArgument(startup::Severity::note, command, i, command.argument(i).description());
    switch (command.name.size() % 4) {
      case 0:
        return Value::ofOpaque(command.name);
      case 1:
        return Value::ofString(command.name);
      case 2:
        return Value::ofInteger(-1);
      default:
        return std::nullopt;
    }
  }
};

// A folder with one file, which is removed at the end.
struct Folder {
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("mpf-fuzz-startup-" + std::to_string(::getpid()));
};

}  // namespace

void playStartup(std::span<const std::uint8_t> input) {
  static const Folder folder;
  std::ofstream(folder.path / "st.cmd", std::ios::binary)
      .write(reinterpret_cast<const char*>(input.data()),
             static_cast<std::streamsize>(input.size()));
  AnyHandler handler;
  startup::StartupShell shell(handler, folder.path);
  shell.forceDialect(input.size() % 2 == 0 ? startup::Dialect::vxWorks : startup::Dialect::iocsh);
  shell.setEnvironment("TOP", "$(A)");
  shell.setEnvironment("A", "a");
  shell.execute("st.cmd");
  for (const auto& diagnostic : shell.diagnostics().all())
    static_cast<void>(diagnostic.formatted());
}

}  // namespace mpf::test
