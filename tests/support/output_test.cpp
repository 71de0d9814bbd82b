// SPDX-License-Identifier: MIT
#include "tests/support/output.h"

#include <gtest/gtest.h>

#include "tests/support/program.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class OutputTest : public testing::Test {
 protected:
  static Program run(const std::string& script) { return Program({"/bin/sh", "-c", script}); }

  Watchdog watchdog_{"output test"};
};

TEST_F(OutputTest, FindsLinesInAnyOrder) {
  const auto program = run("echo first >&2; echo second >&2; exec sleep 1000000");

  EXPECT_EQ(program.waitForLine("second"), "second");
  EXPECT_EQ(program.waitForLine("fir"), "first");
  EXPECT_EQ(program.waitForLine("second"), "second");
}

TEST_F(OutputTest, WaitsForALineThatIsNotThereYet) {
  const auto program = run("kill -STOP $$; echo late >&2");
  ::waitpid(-1, nullptr, WUNTRACED);

  program.signal(SIGCONT);

  EXPECT_EQ(program.waitForLine("late"), "late");
}

TEST_F(OutputTest, ReturnsAnEmptyLineIfTheProgramEnds) {
  const auto program = run("echo one >&2; printf two >&2");

  EXPECT_EQ(program.waitForLine("three"), "");
  EXPECT_EQ(program.waitForLine("two"), "two") << "a last line without its end";
}

TEST_F(OutputTest, ReturnsEachLineOnce) {
  const auto program = run("echo one >&2; echo two >&2; printf three >&2");

  EXPECT_EQ(program.line(), "one");
  EXPECT_EQ(program.waitForLine("one"), "one");
  EXPECT_EQ(program.errors(), "two\nthree");
  EXPECT_EQ(program.line(), "two");
  EXPECT_EQ(program.line(), "three");
  EXPECT_EQ(program.line(), "");
}

// The program writes more than a pipe can hold.
TEST_F(OutputTest, DoesNotBlockTheProgram) {
  auto program = run("head --bytes=1000000 /dev/zero | tr '\\0' x >&2");

  EXPECT_EQ(program.wait(), 0);

  EXPECT_EQ(program.errors().size(), 1'000'000U);
}

}  // namespace
}  // namespace mpf::test
