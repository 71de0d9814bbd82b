// SPDX-License-Identifier: MIT
// Every installed program: --version, --help, and errors about its arguments.
#include <sys/wait.h>

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <sstream>
#include <vector>

#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::AnyOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

std::vector<std::string> programs() {
  std::istringstream list(MPF_TEST_PROGRAMS);
  return {std::istream_iterator<std::string>(list), {}};
}

// The name by which users call a program: `mpf bench` executes mpf-bench.
std::string nameOf(const std::string& program) {
  const auto name = std::filesystem::path(program).filename().string();
  if (name == "mpf-bench") return "mpf bench";
  return name == "mpf-torture" ? "mpf torture" : name;
}

// The output of a command; empty unless it succeeds.
std::string outputOf(const std::string& command) {
  const auto ended = runCommand(command);
  return ended.status == 0 ? ended.output : std::string();
}

class EveryProgram : public testing::TestWithParam<std::string> {
 protected:
  Watchdog watchdog_{"a program"};
};

TEST_P(EveryProgram, PrintsItsVersion) {
  EXPECT_EQ(outputOf(GetParam() + " --version"),
            nameOf(GetParam()) + " " + MPF_TEST_VERSION + "\n");
}

// The man pages are generated from this line.
TEST_P(EveryProgram, DescribesItselfInTheFirstLine) {
  EXPECT_THAT(outputOf(GetParam() + " --help"), StartsWith(nameOf(GetParam()) + " - "));
}

TEST_P(EveryProgram, NamesItselfAndTheWrongArgumentAndExitsWith2) {
  Program program({GetParam(), "--no-such-option"});

  const auto said = program.errors();

  const auto status = program.wait();
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_THAT(said, StartsWith(nameOf(GetParam()) + ": "));
  EXPECT_THAT(said, AnyOf(HasSubstr("--no-such-option"), HasSubstr("is required")));
  EXPECT_THAT(said, AnyOf(EndsWith("`" + nameOf(GetParam()) + " --help` shows how to use it\n"),
                          EndsWith("`" + nameOf(GetParam()) + " --help` shows what they do\n")));
}

INSTANTIATE_TEST_SUITE_P(Programs, EveryProgram, testing::ValuesIn(programs()),
                         [](const auto& test) {
                           auto name = std::filesystem::path(test.param).filename().string();
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace mpf::test
