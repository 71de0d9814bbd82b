// SPDX-License-Identifier: MIT
#include "base/program_beside.h"

#include <filesystem>
#include <gmock/gmock.h>

namespace mpf::test {
namespace {

using testing::HasSubstr;

TEST(ProgramBesideTest, IsInTheFolderOfThisProgram) {
  EXPECT_EQ(std::filesystem::path(programBeside("base_test")),
            std::filesystem::canonical("/proc/self/exe"));
}

TEST(ProgramBesideTest, SaysWhichProgramIsMissingAndWhatToDo) {
  testing::internal::CaptureStderr();

  EXPECT_EQ(executeProgram("mpf-missing", {"-x"}, "install it"), 1);

  const auto error = testing::internal::GetCapturedStderr();
  EXPECT_THAT(error, HasSubstr("cannot start " + programBeside("mpf-missing")));
  EXPECT_THAT(error, HasSubstr("No such file or directory, nor in PATH; install it"));
}

TEST(ProgramBesideDeathTest, ReplacesThisProcess) {
  testing::GTEST_FLAG(death_test_style) = "fast";
  EXPECT_EXIT(std::_Exit(executeProgram("base_test", {"--gtest_list_tests"}, "")),
              testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace mpf::test
