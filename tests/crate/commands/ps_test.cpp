// SPDX-License-Identifier: MIT
// mpf ps: a crate that does not reply. mpf logs: which lines are shown, also of a log that is
// shortened.
#include <sys/wait.h>

#include <filesystem>
#include <fstream>

#include "base/whole_file.h"
#include "tests/crate/supervisor/supervisor_fixture.h"

namespace mpf::crate::test {
namespace {

using mpf::test::runCommand;
using testing::HasSubstr;

using PsTest = SupervisorTest;

TEST_F(PsTest, ShowsTheOtherCratesWhenOneDoesNotReply) {
  run(kServer);
  waitForState("int32", "ready");
  const auto silent = CrateFolder::of("a-silent-one");
  silent.create();
  const auto lock = silent.lock();  // as of a supervisor; it has no socket

  const auto result = runCommand(MPF " ps 2>&1");
  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("mpf ps: the crate \"a-silent-one\" "));
  EXPECT_THAT(result.output, testing::ContainsRegex("int32 +ready"));
  const auto reports = runCommand(MPF " ps --json 2>/dev/null");
  EXPECT_EQ(WEXITSTATUS(reports.status), 1);
  EXPECT_EQ(nlohmann::json::parse(reports.output).at(0).at("crate"), "lab");
}

TEST_F(PsTest, SaysThatASupervisorIsStopped) {
  run(kServer);

  supervisor_->stop();
  const auto result = runCommand(MPF " ps 2>&1");
  supervisor_->signal(SIGCONT);

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("is stopped; `kill -CONT "));
}

class LogsTest : public SupervisorTest {
 protected:
  LogsTest() { folder().create(); }
  void append(const std::string& text) const { std::ofstream(log_, std::ios::app) << text; }
  // Removes the beginning of the log, as the supervisor does on file systems that can.
  void removeBeginning(std::size_t bytes) const {
    const auto rest = readWholeFile(log_).substr(bytes);
    std::fstream(log_, std::ios::in | std::ios::out) << rest;
    std::filesystem::resize_file(log_, rest.size());
  }
  const std::string log_ = folder().log("dac");
  const std::string command_ = MPF " logs dac --crate lab ";
};

TEST_F(LogsTest, ShowsAsManyLinesAsRequested) {
  append("one\ntwo\nthree\n");

  EXPECT_EQ(runCommand(command_).output, "one\ntwo\nthree\n");
  EXPECT_EQ(runCommand(command_ + "-n 2").output, "two\nthree\n");
  EXPECT_EQ(runCommand(command_ + "-n 1").output, "three\n");
  const auto none = runCommand(command_ + "-n 0 2>&1");
  EXPECT_EQ(none.output, "");
  EXPECT_EQ(none.status, 0);
}

TEST_F(LogsTest, RefusesANumberBelow0) {
  append("one\n");

  const auto result = runCommand(command_ + "-n -1 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 2);
  EXPECT_THAT(result.output, HasSubstr("-1 is out of range"));
}

TEST_F(LogsTest, ShowsNothingOfALogThatIsAHole) {
  append("");
  std::filesystem::resize_file(log_, 100);

  EXPECT_EQ(runCommand(command_).status, 0);
}

TEST_F(LogsTest, FollowsALogThatIsShortened) {
  append(std::string(std::size_t{3} << 16, '\n') + "last\n");
  mpf::test::Program logs({"/bin/sh", "-c", "exec " + command_ + "-n 1 -f >&2"});
  ASSERT_EQ(logs.line(), "last");

  removeBeginning(std::size_t{2} << 16);
  append("next\n");

  EXPECT_EQ(logs.line(), "next");
}

}  // namespace
}  // namespace mpf::crate::test
