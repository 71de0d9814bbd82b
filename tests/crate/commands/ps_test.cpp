// SPDX-License-Identifier: MIT
// mpf ps: a crate that does not reply. mpf logs: which lines are shown, also of a log that is
// shortened.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <mpf/file_descriptor.h>

#include "base/whole_file.h"
#include "tests/crate/supervisor/supervisor_fixture.h"
#include "tests/support/sanitized.h"

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

TEST_F(PsTest, NamesACrateThatItCannotSee) {
  const auto hidden = CrateFolder::of("hidden");
  hidden.create();
  const auto lock = hidden.file("lock");
  ASSERT_EQ(::symlink(lock.c_str(), lock.c_str()), 0);  // cannot be opened, also by root

  const auto none = runCommand(MPF " ps 2>&1");
  run(kServer);
  waitForState("int32", "ready");
  const auto other = runCommand(MPF " ps 2>&1");

  for (const auto& result : {none, other}) {
    EXPECT_EQ(WEXITSTATUS(result.status), 1);
    EXPECT_THAT(result.output, HasSubstr("mpf ps: open " + lock + ": "));
  }
  EXPECT_THAT(other.output, testing::ContainsRegex("int32 +ready"));
  EXPECT_EQ(runCommand(MPF " restart int32 --wait 900").status, 0) << "the crate that it sees";
}

TEST_F(PsTest, PrintsAPathWithoutControlCharacters) {
  std::filesystem::create_directory(files_.path() / "a\x1b[2J");
  start({MPF, "run", files_.write("a\x1b[2J/lab.toml", kServer)});

  const auto result = runCommand(MPF " ps");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("/a\\x1b[2J/lab.toml, supervisor "));
  EXPECT_THAT(result.output, testing::Not(HasSubstr("\x1b")));
}

TEST_F(PsTest, SaysThatASupervisorIsStopped) {
  run(kServer);

  supervisor_->stop();
  const auto result = runCommand(MPF " ps 2>&1");
  supervisor_->signal(SIGCONT);

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("is stopped; `kill -CONT "));
}

TEST_F(PsTest, ShowsProcessesWhoseSupervisorHasEnded) {
  run(kServer);
  waitForState("int32", "ready");
  const auto pid = std::to_string(pidOf("int32"));
  const auto file = files_.file("lab.toml");
  killSupervisor();

  const auto result = runCommand(MPF " ps");
  const auto report = nlohmann::json::parse(runCommand(MPF " ps --json").output);
  const auto stopped = runCommand(MPF " stop 2>&1");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("the supervisor of the crate \"lab\" has ended; 1 of its "
                                       "processes runs: `mpf run " +
                                       file + "` takes it over"));
  EXPECT_THAT(result.output, testing::ContainsRegex("int32 +unsupervised +" + pid));
  EXPECT_EQ(report.at(0).at("processes").at(0).at("state"), "unsupervised");
  EXPECT_EQ(WEXITSTATUS(stopped.status), 1);
  EXPECT_THAT(stopped.output, HasSubstr("mpf stop: the supervisor of the crate \"lab\" has ended"));
  run();  // takes it over, so that it ends with the test
  waitForState("int32", "ready");
  EXPECT_EQ(std::to_string(pidOf("int32")), pid);
}

TEST_F(PsTest, FilesOfTheOnlyCrateAreShownAfterItsEnd) {
  run(kServer);
  waitForState("int32", "ready");
  stop();

  EXPECT_THAT(runCommand(MPF " logs int32").output, HasSubstr("serving \"Int32\""));
  EXPECT_EQ(runCommand(MPF " capsule").status, 0);
  CrateFolder::of("other").create();
  for (const std::string command : {"logs int32", "capsule"}) {
    const auto result = runCommand(MPF " " + command + " 2>&1");
    EXPECT_EQ(WEXITSTATUS(result.status), 1);
    EXPECT_THAT(result.output, HasSubstr("choose one with --crate NAME: lab, other"));
    EXPECT_EQ(runCommand(MPF " " + command + " --crate lab").status, 0);
  }
  EXPECT_THAT(runCommand(MPF " capsule --crate none 2>&1").output,
              HasSubstr("there are no files of a crate \"none\""));
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

// The hole is longer than the memory that the test allows; AddressSanitizer needs more.
TEST_F(LogsTest, DoesNotReadTheHoleOfALog) {
  append("");
  std::filesystem::resize_file(log_, std::size_t{3} << 30);
  const auto limited = (mpf::test::kIsSanitized ? "" : "ulimit -v 2000000; ") + command_;
  const auto hole = runCommand(limited + "2>&1");
  append("one\ntwo\n");
  const auto text = runCommand(limited + "2>&1");
  mpf::test::Program logs({"/bin/sh", "-c", "exec " + command_ + "-n 1 -f >&2"});
  ASSERT_EQ(logs.line(), "two");

  append("three\n");

  EXPECT_EQ(logs.line(), "three");
  EXPECT_EQ(hole.output, "");
  EXPECT_EQ(hole.status, 0);
  EXPECT_EQ(text.output, "one\ntwo\n");
}

// The log has not been shortened. The test allows less memory than it has bytes.
TEST_F(LogsTest, ReadsOnlyTheEndOfALongLog) {
  append("first\n");
  std::filesystem::resize_file(log_, std::size_t{3} << 30);
  append("\none\ntwo\n");
  const auto limited = (mpf::test::kIsSanitized ? "" : "ulimit -v 2000000; ") + command_;

  const auto result = runCommand(limited + "-n 1 2>&1");

  EXPECT_EQ(result.output, "two\n");
  EXPECT_EQ(result.status, 0);
}

TEST_F(LogsTest, FollowingEndsWhenTheOutputIsFull) {
  append("one\n");

  const auto result = runCommand(command_ + "-f 2>&1 >/dev/full");

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("mpf logs: standard output: "));
}

TEST_F(LogsTest, FollowingEndsWithTheProgramThatReadsTheOutput) {
  append("one\n");

  EXPECT_EQ(runCommand(command_ + "-f | head -n 1").output, "one\n");
}

TEST_F(LogsTest, FollowsALogThatIsShortened) {
  append(std::string(std::size_t{3} << 16, '\n') + "last\n");
  mpf::test::Program logs({"/bin/sh", "-c", "exec " + command_ + "-n 1 -f >&2"});
  ASSERT_EQ(logs.line(), "last");

  removeBeginning(std::size_t{2} << 16);
  append("next\n");

  EXPECT_EQ(logs.line(), "next");
}

TEST_F(LogsTest, FollowsALogIfTheUserHasNoInotifyInstanceLeft) {
  append("one\n");
  mpf::test::Program logs(
      {"/bin/sh", "-c", "exec env LD_PRELOAD=" MPF_TEST_NO_INOTIFY " " + command_ + "-f >&2"});
  ASSERT_EQ(logs.line(), "one");

  append("two\n");

  EXPECT_EQ(logs.line(), "two");
}

// Other file systems make the beginning of the log a hole.
TEST_F(LogsTest, FollowsALogWhoseBeginningBecomesAHole) {
  constexpr std::size_t kHole = std::size_t{2} << 16;
  const std::string first = "last\n";
  append(first);
  mpf::test::Program logs({"/bin/sh", "-c", "exec " + command_ + "-n 1 -f >&2"});
  ASSERT_EQ(logs.line(), "last");

  logs.stop();
  append(std::string(kHole - first.size() - 1, '-') + "\nnext\n");
  const FileDescriptor file(::open(log_.c_str(), O_RDWR | O_CLOEXEC));
  const auto mode = FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE;
  ASSERT_EQ(::fallocate(file.get(), mode, 0, kHole), 0);
  logs.signal(SIGCONT);

  EXPECT_EQ(logs.line(), "next");
}

}  // namespace
}  // namespace mpf::crate::test
