// SPDX-License-Identifier: MIT
// Startup files of real users. MPF_CORPUS is their folder; without it the test looks beside this
// tree.
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <optional>
#include <string>

#include "crate/startup/shell/startup_shell.h"

namespace mpf::test {
namespace {

using startup::Value;

std::filesystem::path folderOfUsers() {
  const char* const said = std::getenv("MPF_CORPUS");
  return std::filesystem::path(said == nullptr ? MPF_CORPUS_NEARBY : said) / "startup";
}

bool isStartupFile(const std::filesystem::path& path) {
  const auto name = path.filename().string();
  return name.find(".cmd") != std::string::npos || name.starts_with("nfs");
}

// Accepts every command.
class AnyCommand final : public startup::CommandHandler {
 public:
  std::optional<Value> tryExecute(const startup::Command& command,
                                  startup::StartupShell& /*shell*/) override {
    ++commands;
    return Value::ofOpaque(command.name);
  }
  int commands = 0;
};

// What cdCommands of a site defines.
void defineFolders(startup::StartupShell& shell, const std::string& folder) {
  for (const auto* name : {"top", "topbin", "startup", "appbin", "std", "ip", "mca", "motor",
                           "quadem", "dac128v", "ip330", "ipunidig"})
    shell.define(name, Value::ofString(folder));
}

TEST(RealFilesTest, HaveNoErrorsThatAreNotTheirOwn) {
  if (!std::filesystem::is_directory(folderOfUsers()))
    GTEST_SKIP() << "no startup files of users in " << folderOfUsers();
  int commands = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folderOfUsers())) {
    if (!entry.is_regular_file() || !isStartupFile(entry.path())) continue;
    AnyCommand handler;
    startup::StartupShell shell(handler, entry.path().parent_path());
    defineFolders(shell, entry.path().parent_path().string());
    shell.execute(entry.path().filename());
    commands += handler.commands;
    for (const auto& diagnostic : shell.diagnostics().all())
      if (diagnostic.severity == startup::Severity::error) ADD_FAILURE() << diagnostic.formatted();
  }
  EXPECT_GT(commands, 0);
}

}  // namespace
}  // namespace mpf::test
