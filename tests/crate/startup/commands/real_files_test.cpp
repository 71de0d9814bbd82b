// SPDX-License-Identifier: MIT
// Startup files of real users as crates. MPF_CORPUS is their folder; without it the test looks
// beside this tree.
#include <cstdlib>
#include <set>

#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

std::filesystem::path startupFilesOfUsers() {
  const char* const said = std::getenv("MPF_CORPUS");
  return std::filesystem::path(said == nullptr ? MPF_CORPUS_NEARBY : said) / "startup";
}

// Files that start nothing alone: they are included by others, or all their commands are comments.
bool startsNothing(const std::filesystem::path& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return text.find("\ninitSerialServer") == std::string::npos &&
         text.find("\niocInit") == std::string::npos &&
         text.find("\ntcpMessageRouter") == std::string::npos;
}

class RealStartupFiles : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(startupFilesOfUsers()))
      GTEST_SKIP() << "no startup files of users in " << startupFilesOfUsers();
  }
};

TEST_F(RealStartupFiles, AreCratesOnModels) {
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(startupFilesOfUsers())) {
    const auto name = entry.path().filename().string();
    if (!name.starts_with("st") || name.find(".cmd") == std::string::npos ||
        startsNothing(entry.path()))
      continue;
    ++files;
    startup::StartupOptions options{.carriers = {{"", "model"}}, .address = "127.0.0.1"};
    try {
      const auto startup = startup::readStartup(entry.path().string(), options);
      EXPECT_FALSE(startup.crate.processes.empty()) << entry.path();
    } catch (const ConfigError& error) {
      ADD_FAILURE() << error.what();
    }
  }
  EXPECT_GT(files, 0);
}

}  // namespace
}  // namespace mpf::test
