// SPDX-License-Identifier: MIT
#include "epics/commands/child_program.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <gtest/gtest.h>
#include <thread>

#include <mpf/file_descriptor.h>

namespace mpf::test {
namespace {

TEST(ChildProgramTest, ReturnsTheExitStatusEachTime) {
  ChildProgram program("sh", {"-c", "exit 3"});

  EXPECT_EQ(program.wait(), 3);
  EXPECT_EQ(program.wait(), 3);
}

TEST(ChildProgramTest, ReturnsTheSignalThatKilledIt) {
  ChildProgram program("sleep", {"1000"});

  program.terminate();

  EXPECT_EQ(program.wait(), 128 + SIGTERM);
}

TEST(ChildProgramTest, ReportsAProgramThatDoesNotExist) {
  EXPECT_EQ(ChildProgram("mpf-no-such-program", {}).wait(), 127);
}

TEST(ChildProgramTest, PassesArgumentsUnchangedAndNoInput) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const FileDescriptor output(ends[0]);
  FileDescriptor toOutput(ends[1]);
  ChildProgram program("sh", {"-c", "printf '%s|' \"$@\"; cat", "sh", "a b", "", "$c"},
                       toOutput.get());
  toOutput.reset();

  EXPECT_EQ(program.wait(), 0);
  std::array<char, 100> text{};
  EXPECT_GT(::read(output.get(), text.data(), text.size() - 1), 0);
  EXPECT_STREQ(text.data(), "a b||$c|");
}

TEST(ChildProgramTest, EndsWithTheObject) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const FileDescriptor output(ends[0]);
  FileDescriptor toOutput(ends[1]);
  {
    const ChildProgram program("sleep", {"1000"}, toOutput.get());
  }
  toOutput.reset();

  char byte = 0;
  EXPECT_EQ(::read(output.get(), &byte, 1), 0) << "the program has closed its output";
}

// The program ignores SIGTERM; one that is stopped does not receive it.
TEST(ChildProgramTest, EndsWithTheObjectAlsoIfItIgnoresTheRequestToEnd) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const FileDescriptor output(ends[0]);
  FileDescriptor toOutput(ends[1]);
  char byte = 0;
  {
    const ChildProgram program("sh", {"-c", "trap '' TERM; printf x; exec sleep 1000"},
                               toOutput.get());
    ASSERT_EQ(::read(output.get(), &byte, 1), 1);
  }
  toOutput.reset();

  EXPECT_EQ(::read(output.get(), &byte, 1), 0) << "the program has closed its output";
}

// wait() has begun before terminate().
TEST(ChildProgramTest, AWaitEndsWhenTheProgramIgnoresTheRequestToEnd) {
  ChildProgram program("sh", {"-c", "kill -STOP $$"});
  const std::jthread terminating([&] { program.terminate(); });

  EXPECT_GT(program.wait(), 128);
}

}  // namespace
}  // namespace mpf::test
