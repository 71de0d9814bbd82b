// SPDX-License-Identifier: MIT
// Options that several subcommands share.
#include "tools/arguments.h"

#include <stdlib.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::tools {
namespace {

using testing::HasSubstr;

// Parses one word after the other as arguments of the program. Returns the error, or nothing.
std::string errorOf(CLI::App& app, std::vector<std::string> words) {
  std::ranges::reverse(words);  // as CLI11 wants them
  try {
    app.parse(words);
    return {};
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
}

class ToolArgumentsTest : public testing::Test {
 protected:
  ToolArgumentsTest() {
    ::unsetenv("MPF_BACKPLANE");
    ::unsetenv("MPF_LOCATION");
  }
};

TEST_F(ToolArgumentsTest, AServerIsItsNameLocationAndBackplane) {
  ServerArguments arguments;
  CLI::App app;
  addServer(app, arguments);

  EXPECT_EQ(errorOf(app, {"dac", "--location", "-3", "--backplane", "lab"}), "");

  EXPECT_EQ(arguments.server, "dac");
  EXPECT_EQ(chosenLocation(arguments.location), -3);
  EXPECT_EQ(arguments.backplane, "lab");
}

TEST_F(ToolArgumentsTest, AServerNeedsAName) {
  ServerArguments arguments;
  CLI::App app;
  addServer(app, arguments);

  EXPECT_THAT(errorOf(app, {"--location", "1"}), HasSubstr("server is required"));
}

TEST_F(ToolArgumentsTest, DefaultsComeFromTheEnvironment) {
  ::setenv("MPF_BACKPLANE", "lab", 1);
  ::setenv("MPF_LOCATION", "4", 1);
  ServerArguments arguments;
  CLI::App app;
  addServer(app, arguments);

  EXPECT_EQ(errorOf(app, {"dac"}), "");

  EXPECT_EQ(chosenLocation(arguments.location), 4);
  EXPECT_EQ(arguments.backplane, "lab");
}

// The other commands, and --help, do not use the variable.
TEST_F(ToolArgumentsTest, AWrongLocationOfTheEnvironmentIsAnErrorOnlyWhereItIsUsed) {
  ::setenv("MPF_LOCATION", "lab", 1);
  ServerArguments arguments;
  CLI::App app;
  addServer(app, arguments);

  EXPECT_EQ(errorOf(app, {"dac"}), "");
  EXPECT_THROW(static_cast<void>(chosenLocation(arguments.location)), std::invalid_argument);
  EXPECT_EQ(errorOf(app, {"dac", "--location", "2"}), "");
  EXPECT_EQ(chosenLocation(arguments.location), 2);
}

TEST_F(ToolArgumentsTest, ABackplaneStaysEmptyUnlessTheUserNamesOne) {
  std::string backplane;
  CLI::App app;
  addBackplane(app, backplane, "all backplanes");

  EXPECT_EQ(errorOf(app, {}), "");

  EXPECT_EQ(backplane, "");
  EXPECT_THAT(app.help(), HasSubstr("$MPF_BACKPLANE, or all backplanes"));
}

}  // namespace
}  // namespace mpf::tools
