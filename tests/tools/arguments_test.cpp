// SPDX-License-Identifier: MIT
// Options that several subcommands share.
#include "tools/arguments.h"

#include <stdlib.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::tools {
namespace {

using namespace std::chrono_literals;
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
  // The error for this value of an option for seconds, whose value is then in `seconds_`.
  std::string secondsError(const std::string& word, bool mayBeZero) {
    CLI::App app;
    addSeconds(app, "--timeout", seconds_, "Longest wait", mayBeZero);
    return errorOf(app, {"--timeout", word});
  }

  double seconds_ = 2.5;
};

TEST_F(ToolArgumentsTest, AServerIsItsNameLocationAndBackplane) {
  ServerArguments arguments;
  CLI::App app;
  addServer(app, arguments);

  EXPECT_EQ(errorOf(app, {"dac", "--location", "-3", "--backplane", "lab"}), "");

  EXPECT_EQ(arguments.server, "dac");
  EXPECT_EQ(arguments.location, -3);
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

  EXPECT_EQ(arguments.location, 4);
  EXPECT_EQ(arguments.backplane, "lab");
}

TEST_F(ToolArgumentsTest, ABackplaneStaysEmptyUnlessTheUserNamesOne) {
  std::string backplane;
  CLI::App app;
  addBackplane(app, backplane, "all backplanes");

  EXPECT_EQ(errorOf(app, {}), "");

  EXPECT_EQ(backplane, "");
  EXPECT_THAT(app.help(), HasSubstr("$MPF_BACKPLANE, or all backplanes"));
}

TEST_F(ToolArgumentsTest, SecondsAreNumbersFromZeroOrAboveZero) {
  EXPECT_EQ(secondsError("0.25", false), "");
  EXPECT_EQ(seconds_, 0.25);
  EXPECT_EQ(secondsError("1e9", false), "");
  EXPECT_EQ(secondsError("0", true), "");
  EXPECT_EQ(seconds_, 0);

  for (const std::string word : {"-1", "nan", "1e300", "1000000001", "soon"})
    EXPECT_THAT(secondsError(word, true),
                HasSubstr(word + " is not a time: use a number of seconds from 0 to 1e9"));
  EXPECT_THAT(secondsError("0", false),
              HasSubstr("0 is not a time: use a number of seconds above 0 to 1e9"));
  EXPECT_EQ(seconds_, 0) << "unchanged";
}

TEST_F(ToolArgumentsTest, TheHelpOfSecondsShowsTheDefault) {
  CLI::App app;
  addSeconds(app, "--timeout", seconds_, "Longest wait", false);

  EXPECT_THAT(app.help(), HasSubstr("--timeout SECONDS=2.5 "));
}

TEST(OfSeconds, AreNanoseconds) {
  EXPECT_EQ(ofSeconds(0), 0ns);
  EXPECT_EQ(ofSeconds(0.25), 250ms);
  EXPECT_EQ(ofSeconds(1e9), 1'000'000'000s);
}

}  // namespace
}  // namespace mpf::tools
