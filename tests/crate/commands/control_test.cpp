// SPDX-License-Identifier: MIT
// mpf stop, mpf start, mpf restart, mpf reload: their options, names that no process has, and what
// they report.
#include <sys/wait.h>

#include <filesystem>

#include "tests/crate/supervisor/supervisor_fixture.h"

namespace mpf::crate::test {
namespace {

using mpf::test::runCommand;
using testing::HasSubstr;

using ControlTest = SupervisorTest;

TEST_F(ControlTest, RefusesATimeThatCannotBeWaitedFor) {
  for (const std::string time : {"inf", "nan", "1e300", "-1"}) {
    const auto result = runCommand(MPF " stop --wait " + time + " 2>&1");

    EXPECT_EQ(WEXITSTATUS(result.status), 2) << time;
    EXPECT_THAT(result.output, HasSubstr(time + " is not a time"));
  }
}

TEST_F(ControlTest, ANameThatIsNotUtf8IsUnknown) {
  run(kServer);

  const auto result = runCommand(MPF " stop \"$(printf '\\377')\" 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("the crate has no process"));
}

TEST_F(ControlTest, AReloadReturnsWhenTheProcessesAreReady) {
  run(kServer);
  waitForState("int32", "ready");
  const auto pid = pidOf("int32");

  EXPECT_THAT(runCommand(MPF " reload --wait 900").output,
              HasSubstr("no process is started or restarted"));
  write(kServer + "queue-size = 7\n");
  const auto result = runCommand(MPF " reload --wait 900");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("int32 is ready"));
  EXPECT_EQ(stateOf("int32"), "ready");
  EXPECT_NE(pidOf("int32"), pid);
}

TEST_F(ControlTest, AReloadSaysWhichProcessFails) {
  run(kServer);
  write(kServer +
        "[[program]]\nname = \"wrong\"\ncommand = [\"sh\", \"-c\", \"exit 2\"]\nservers = "
        "[\"never\"]\n");

  const auto result = runCommand(MPF " reload --wait 900 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("mpf reload: wrong has failed: exit status 2"));
}

TEST_F(ControlTest, AFailureIsShownWithTheLastLineOfTheProcess) {
  run("[[program]]\nname = \"wrong\"\ncommand = [\"sh\", \"-c\", \"test -e twice && exit 2; touch "
      "twice; echo from an earlier start; exit 2\"]\nservers = [\"never\"]\n");
  waitForState("wrong", "failed");

  const auto silent = runCommand(MPF " start wrong --wait 900 2>&1").output;
  std::filesystem::remove(files_.file("twice"));
  const auto result = runCommand(MPF " start wrong --wait 900 2>&1");

  EXPECT_THAT(silent, HasSubstr("wrong has failed: exit status 2; see"));
  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output,
              HasSubstr("wrong has failed: exit status 2: from an earlier start; see"));
}

TEST_F(ControlTest, APauseIsShownWithTheLastLineOfTheProcess) {
  run("[[program]]\nname = \"wrong\"\ncommand = [\"sh\", \"-c\", \"echo why; exit 1\"]\n"
      "servers = [\"never\"]\n",
      "first-pause = \"15min\"\nlast-pause = \"15min\"\n");

  std::string output;
  while (output.find("pausing") == std::string::npos)
    output = runCommand(MPF " start wrong --wait 100ms 2>&1").output;

  EXPECT_THAT(output, HasSubstr("wrong is still pausing after 100ms: exit status 1: why\n"));
}

TEST_F(ControlTest, AReloadNamesEachErrorOfTheFile) {
  run(kServer);
  write(kServer + "first = 1\nsecond = 2\n");

  const auto result = runCommand(MPF " reload 2>&1 >/dev/null");

  EXPECT_EQ(WEXITSTATUS(result.status), 2);
  EXPECT_THAT(result.output, testing::MatchesRegex("mpf reload: [^\n]*\"first\"[^\n]*\n"
                                                   "mpf reload: [^\n]*\"second\"[^\n]*\n"));
}

TEST_F(ControlTest, AProgramThatDoesNotReportIsLookedAtForASecond) {
  run("[[program]]\nname = \"mute\"\ncommand = [\"sleep\", \"1000\"]\n");
  waitForState("mute", "ready");

  EXPECT_EQ(runCommand(MPF " restart mute --wait 900").status, 0);

  EXPECT_GE(process("mute").at("up_s"), 1);
}

TEST_F(ControlTest, AStopNamesTheProcessesThatContinue) {
  run(kServer +
      "[[program]]\nname = \"user\"\ncommand = [\"sleep\", \"1000\"]\n"
      "needs = [\"int32\"]\n");
  waitForState("user", "ready");

  const auto result = runCommand(MPF " stop int32 --wait 900");

  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("processes that need int32 continue: user"));
  EXPECT_EQ(stateOf("user"), "ready");
}

TEST_F(ControlTest, AStopFailsWhenTheSupervisorIsKilledBeforeItsProcesses) {
  run("[[program]]\nname = \"deaf\"\n"
      "command = [\"sh\", \"-c\", \"trap '' TERM; echo on; exec sleep 1000\"]\n");
  ASSERT_NE(supervisor_->waitForLine("deaf | on"), "");
  const auto pid = pidOf("deaf");
  mpf::test::Program stop({MPF, "stop", "--crate", "lab", "--wait", "900"});
  waitForState("deaf", "stopping");

  killSupervisor();

  EXPECT_EQ(WEXITSTATUS(stop.wait()), 1);
  EXPECT_THAT(stop.errors(), HasSubstr("the supervisor of the crate \"lab\" has ended; 1 of"));
  ::kill(pid, SIGKILL);
}

TEST_F(ControlTest, TheTimeToWaitIsAlsoThatOfASupervisorThatDoesNotReply) {
  const CrateFolder silent = CrateFolder::of("silent");
  silent.create();
  const auto lock = silent.lock();
  const auto listening = listenForControl(silent);

  for (const std::string command : {"stop x", "start x", "restart x", "stop", "reload"}) {
    const auto result = runCommand(MPF " " + command + " --crate silent --wait 1ms 2>&1");

    EXPECT_EQ(WEXITSTATUS(result.status), 1);
    EXPECT_THAT(result.output, HasSubstr("does not reply within 2s;"));
  }
}

TEST_F(ControlTest, AProcessThatIsNotReadySaysWhatIsMissing) {
  run("[[program]]\nname = \"mute\"\ncommand = [\"sleep\", \"1000\"]\nservers = [\"never\"]\n"
      "start-time = \"1ms\"\n");

  while (process("mute")
             .value("reason", "")
             .find("not ready within 1000.0 us: clients cannot bind "
                   "to never at location 0") == std::string::npos)
    continue;
}

}  // namespace
}  // namespace mpf::crate::test
