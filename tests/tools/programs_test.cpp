// SPDX-License-Identifier: MIT
// `mpf torture` and `mpf bench` execute programs that are in the folder of `mpf`, or in PATH.
#include <sys/wait.h>

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/command.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

// A copy of `mpf` in a folder that the other programs are not in.
class ProgramsTest : public testing::Test {
 protected:
  ProgramsTest() { std::filesystem::copy_file(MPF_TEST_TOOL, program_); }
  // Creates a program that prints its name and arguments.
  void install(const std::string& name, std::filesystem::perms rights) const {
    folder_.write(name, "#!/bin/sh\nfor each in \"$0\" \"$@\"; do echo \"$each\"; done\nexit 7\n");
    std::filesystem::permissions(folder_.path() / name, rights);
  }

  TemporaryFolder folder_;
  std::string program_ = folder_.file("mpf");
};

TEST_F(ProgramsTest, GetAllArgumentsUnchanged) {
  install("mpf-torture", std::filesystem::perms::owner_all);

  const auto ended = runCommand(program_ + " torture --help 'a b' -- --backplane=x");

  EXPECT_EQ(WEXITSTATUS(ended.status), 7);
  EXPECT_EQ(ended.output, folder_.file("mpf-torture") + "\n--help\na b\n--\n--backplane=x\n");
}

TEST_F(ProgramsTest, MayBeInPath) {
  install("mpf-torture", std::filesystem::perms::owner_all);
  const TemporaryFolder other;
  std::filesystem::rename(program_, other.file("mpf"));

  const auto ended =
      runCommand("PATH=" + folder_.path().string() + " " + other.file("mpf") + " torture -x");

  EXPECT_EQ(WEXITSTATUS(ended.status), 7);
  EXPECT_THAT(ended.output, testing::EndsWith("mpf-torture\n-x\n"));
}

TEST_F(ProgramsTest, AMissingProgramIsAnErrorWithARemedy) {
  const auto torture = runCommand("PATH=/nowhere " + program_ + " torture 2>&1");
  const auto bench = runCommand("PATH=/nowhere " + program_ + " bench local 2>&1");

  EXPECT_EQ(WEXITSTATUS(torture.status), 1);
  EXPECT_EQ(torture.output, "cannot start " + folder_.file("mpf-torture") +
                                ": No such file or directory, nor in PATH; install MPF with `make "
                                "install`: the Python package does not have this program\n");
  EXPECT_EQ(WEXITSTATUS(bench.status), 1);
  EXPECT_EQ(bench.output, "cannot start " + folder_.file("mpf-bench") +
                              ": No such file or directory, nor in PATH; build MPF with "
                              "MPF_BUILD_BENCHMARKS=ON to get this program\n");
}

TEST_F(ProgramsTest, AProgramThatMayNotBeExecutedIsAnError) {
  install("mpf-bench", std::filesystem::perms::owner_read);

  const auto ended = runCommand(program_ + " bench 2>&1");

  EXPECT_EQ(WEXITSTATUS(ended.status), 1);
  EXPECT_THAT(ended.output, testing::HasSubstr("mpf-bench: Permission denied; "));
}

}  // namespace
}  // namespace mpf::test
