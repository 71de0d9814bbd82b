// SPDX-License-Identifier: MIT
// Supervisor: crates that run: processes that die and are replaced; supervisors that are killed.
#include "crate/supervisor/supervisor.h"

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <sstream>
#include <thread>
#include <vector>

#include <mpf/sync_client.h>

#include "base/whole_file.h"
#include "crate/supervisor/crate_state.h"
#include "crate/supervisor/notify_socket.h"
#include "tests/crate/supervisor/supervisor_fixture.h"

// NOLINTBEGIN(modernize-raw-string-literal): a crate is one line
namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;
using mpf::test::runCommand;
using testing::HasSubstr;

TEST_F(SupervisorTest, StartsProcessesUntilTheirServersAreBindable) {
  run(kServer +
      "[carriers]\nipac = \"model\"\n[[server]]\nprogram = \"dac128v\"\n"
      "module = \"dac\"\ncarrier = \"ipac\"\nsite = \"IP_a\"\n");

  waitForState("int32", "ready");
  waitForState("dac", "ready");

  EXPECT_TRUE(isReplying("Int32"));
  EXPECT_TRUE(isReplying("dac"));
  EXPECT_EQ(WEXITSTATUS(stop()), 0);
  EXPECT_FALSE(folder().isLocked());
}

TEST_F(SupervisorTest, RestartsAProcessThatDies) {
  run(kServer);
  waitForState("int32", "ready");
  const auto before = pidOf("int32");

  ::kill(before, SIGSEGV);
  waitForNew("int32", before);

  EXPECT_EQ(process("int32").at("restarts"), 1);
  EXPECT_EQ(process("int32").at("reason"), "SIGSEGV");
  EXPECT_TRUE(isReplying("Int32"));
}

TEST_F(SupervisorTest, TheLogShowsEachStartAndEnd) {
  run(kServer);
  waitForState("int32", "ready");
  const auto before = pidOf("int32");
  ::kill(before, SIGSEGV);
  waitForNew("int32", before);
  const auto after = pidOf("int32");
  ASSERT_EQ(runCommand(MPF " restart int32 --wait 900").status, 0);
  ASSERT_EQ(runCommand(MPF " stop int32 --wait 900").status, 0);

  std::istringstream log(readWholeFile(folder().log("int32")));
  std::vector<std::string> notes;
  const std::string stamp = "-- 2026-11-30 10:39:31 ";
  for (std::string line; std::getline(log, line);)
    if (line.starts_with("-- ")) notes.push_back(line.substr(stamp.size()));

  ASSERT_EQ(notes.size(), 6u);
  EXPECT_EQ(notes[0], fmt::format("started, pid {}", before));
  EXPECT_EQ(notes[1], "SIGSEGV; restart 1");
  EXPECT_EQ(notes[2], fmt::format("started, pid {}", after));
  EXPECT_EQ(notes[3], "restarted by request, exit status 0; restart 2");
  EXPECT_EQ(notes[5], "stopped by request, exit status 0; stopped");
}

TEST_F(SupervisorTest, KeepsACapsuleOfAProcessThatDies) {
  run(kServer);
  waitForState("int32", "ready");
  ASSERT_TRUE(isReplying("Int32"));
  const auto before = pidOf("int32");

  ::kill(before, SIGSEGV);
  waitForNew("int32", before);

  EXPECT_THAT(supervisor_->waitForLine("SIGSEGV after"), HasSubstr("see `mpf capsule "));
  const auto capsules = runCommand(MPF " capsule").output;
  EXPECT_THAT(capsules, HasSubstr("\"int32\" died by SIGSEGV"));
  const auto path = capsules.substr(0, capsules.find('\n'));
  EXPECT_THAT(runCommand(MPF " capsule " + path).output, HasSubstr("Int32"));
}

TEST_F(SupervisorTest, StartsThatFailInTheSameWayHaveOneCapsule) {
  run("[[program]]\nname = \"a\"\ncommand = [\"sh\", \"-c\", \"exit 1\"]\nservers = [\"never\"]\n",
      "max-restarts = 3\n");

  waitForState("a", "failed");

  const auto capsules = runCommand(MPF " capsule").output;
  EXPECT_EQ(std::count(capsules.begin(), capsules.end(), '\n'), 2) << capsules;
}

TEST_F(SupervisorTest, ARequestedStopLeavesNoCapsule) {
  run(kServer);
  waitForState("int32", "ready");
  ask({{"do", "restart"}, {"name", "int32"}});
  while (process("int32").at("restarts") != 1) continue;
  waitForState("int32", "ready");
  ask({{"do", "stop"}, {"name", "int32"}});
  waitForState("int32", "stopped");

  const auto capsules = runCommand(MPF " capsule").output;

  EXPECT_THAT(capsules, HasSubstr("restart"));
  EXPECT_EQ(std::count(capsules.begin(), capsules.end(), '\n'), 2) << capsules;
}

TEST_F(SupervisorTest, AProcessStartsAfterThoseThatItNeeds) {
  run(kServer + "name = \"a\"\nneeds = [\"b\"]\n" + kServer + "name = \"b\"\nserver = \"B\"\n");
  waitForState("a", "ready");
  ASSERT_EQ(stateOf("b"), "ready");

  EXPECT_EQ(WEXITSTATUS(stop()), 0);
}

TEST_F(SupervisorTest, ARouterIsReadyWhenItListens) {
  run("[[router]]\nserve = \"1=0\"\nlisten = \"127.0.0.1:0\"\nplain = true\n" + kServer +
      "needs = [\"router\"]\n");

  waitForState("int32", "ready");

  EXPECT_EQ(stateOf("router"), "ready");
  EXPECT_NE(supervisor_->waitForLine("router | "), "");
}

TEST_F(SupervisorTest, AProcessWaitsForOneThatFails) {
  run(kServer +
      "name = \"a\"\nneeds = [\"b\"]\n[[program]]\nname = \"b\"\n"
      "command = [\"/bin/sh\", \"-c\", \"exit 2\"]\nservers = [\"never\"]\n");

  waitForState("b", "failed");

  EXPECT_EQ(stateOf("a"), "waiting");
}

TEST_F(SupervisorTest, TellsSystemdThatItIsReadyAlthoughAProcessFailsForEver) {
  const NotifySocket systemd;
  ::setenv("NOTIFY_SOCKET", systemd.name().c_str(), 1);

  run(kServer +
          "[[program]]\nname = \"absent\"\ncommand = [\"sh\", \"-c\", \"exit 1\"]\n"
          "servers = [\"never\"]\n[[program]]\nname = \"user\"\n"
          "command = [\"sleep\", \"1000\"]\nneeds = [\"absent\"]\n",
      "max-restarts = 1000000\n");
  ::unsetenv("NOTIFY_SOCKET");

  while (systemd.takeReady().empty()) continue;
  EXPECT_EQ(stateOf("int32"), "ready");
  EXPECT_EQ(stateOf("user"), "waiting");
}

// The server is replaced while clients call it: no call fails, and none gets the wrong reply.
TEST_F(SupervisorTest, ReplacesAServerUnderLoad) {
  run(kServer);
  waitForState("int32", "ready");
  std::atomic<bool> isOver{false};
  std::vector<std::thread> clients;
  for (int thread = 0; thread < 2; ++thread) {
    clients.emplace_back([&, thread] {
      SyncClient client(backplane_, "Int32");
      for (int i = 0; !isOver; ++i) {
        const auto value = thread * 1'000'000'000 + i;
        auto answer = client.call(Int32Message({.value = value}), 900s, Retry::neverTaken);
        const auto reply = answer.as<Int32>();
        ASSERT_TRUE(reply) << answer.why();
        ASSERT_EQ((*reply)->value, value);
      }
    });
  }

  for (int i = 0; i < 20; ++i) {
    const auto before = pidOf("int32");
    ask({{"do", "restart"}, {"name", "int32"}});
    waitForNew("int32", before);
  }

  isOver = true;
  for (auto& client : clients) client.join();
  EXPECT_EQ(process("int32").at("restarts"), 20);
}

// "The supervisor itself may be killed at any moment: servers go on, and a new supervisor takes
// over those that run."
TEST_F(SupervisorTest, ANewSupervisorTakesOverWhatRuns) {
  run(kServer + kServer + "name = \"two\"\nserver = \"Two\"\n");
  waitForState("int32", "ready");
  waitForState("two", "ready");
  const auto one = pidOf("int32");
  const auto two = pidOf("two");

  killSupervisor();
  EXPECT_TRUE(isReplying("Int32"));
  ::kill(two, SIGKILL);
  run();
  waitForState("int32", "ready");
  waitForNew("two", two);

  EXPECT_EQ(pidOf("int32"), one);
  ::kill(one, SIGKILL);
  waitForNew("int32", one);
  EXPECT_TRUE(isReplying("Int32"));
}

TEST_F(SupervisorTest, TakesOverACrateInAFolderWhoseNameIsNotUtf8) {
  const auto folder = files_.file("d\xe9");
  std::filesystem::create_directory(folder);
  write(kServer);
  std::filesystem::rename(files_.file("lab.toml"), folder + "/lab.toml");
  start({MPF, "run", folder + "/lab.toml"});
  waitForState("int32", "ready");
  const auto before = pidOf("int32");

  killSupervisor();
  start({MPF, "run", folder + "/lab.toml"});
  waitForState("int32", "ready");

  EXPECT_EQ(pidOf("int32"), before);
}

// A router reads its file only when it starts.
TEST_F(SupervisorTest, ATakenOverProcessWithAChangedFileIsRestarted) {
  const std::string listen = "[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n";
  static_cast<void>(files_.write("router.toml", listen + "[[serve]]\nlocation = 1\nlocal = 0\n"));
  run("[[router]]\nfile = \"router.toml\"\n");
  waitForState("router", "ready");
  const auto before = pidOf("router");
  killSupervisor();
  run();
  waitForState("router", "ready");
  ASSERT_EQ(pidOf("router"), before);

  killSupervisor();
  static_cast<void>(files_.write("router.toml", listen + "[[serve]]\nlocation = 2\nlocal = 0\n"));
  run();

  waitForNew("router", before);
}

TEST_F(SupervisorTest, TakesOverAndSeesEndsWithoutPidfds) {
  run(kServer);
  waitForState("int32", "ready");
  const auto one = pidOf("int32");

  killSupervisor();
  // NOLINTNEXTLINE(bugprone-suspicious-missing-comma): one argument
  start({"/usr/bin/env", "LD_PRELOAD=" MPF_TEST_NO_PIDFD, MPF, "run", files_.file("lab.toml")});
  waitForState("int32", "ready");
  EXPECT_EQ(pidOf("int32"), one);
  ::kill(one, SIGKILL);
  waitForNew("int32", one);

  EXPECT_TRUE(isReplying("Int32"));
}

// The old process of this name was stopped; its successor is another one.
TEST_F(SupervisorTest, AReplacedProcessIsRestartedAndStoppedAfterATakeOver) {
  run("[[server]]\nname = \"int32\"\nprogram = \"int32\"\nqueue-size = 10\n");
  waitForState("int32", "ready");
  const auto first = pidOf("int32");
  write("[[server]]\nname = \"int32\"\nprogram = \"int32\"\nqueue-size = 11\n");
  ask({{"do", "reload"}});
  waitForNew("int32", first);
  const auto second = pidOf("int32");

  killSupervisor();
  run();
  waitForState("int32", "ready");
  ASSERT_EQ(pidOf("int32"), second);
  ::kill(second, SIGKILL);
  waitForNew("int32", second);

  EXPECT_EQ(WEXITSTATUS(stop()), 0);
}

TEST_F(SupervisorTest, ContinuesWhileItsStateCannotBeRecorded) {
  run(kServer);
  waitForState("int32", "ready");
  const auto pid = pidOf("int32");
  const auto blocked = folder().file("state.json.new");
  ASSERT_TRUE(std::filesystem::create_directory(blocked));

  ::kill(pid, SIGKILL);
  waitForNew("int32", pid);
  EXPECT_EQ(process("int32").at("restarts"), 1) << "the start did not fail";

  std::filesystem::remove(blocked);
  const auto recorded = [&] { return CrateState::read(folder().file("state.json")).processes; };
  while (recorded().at(0).pid != pidOf("int32")) continue;
}

TEST_F(SupervisorTest, IsKilledAtRandomMomentsWithoutOrphansOrDoubles) {
  run(kServer + kServer + "name = \"two\"\nserver = \"Two\"\n");
  for (int i = 0; i < 30; ++i) {
    const auto pid = i % 3 == 0 ? pidOf("two") : 0;
    if (pid > 0) ::kill(pid, SIGKILL);
    killSupervisor();
    run();
  }
  waitForState("int32", "ready");
  waitForState("two", "ready");

  EXPECT_TRUE(isReplying("Int32"));
  EXPECT_TRUE(isReplying("Two"));
  EXPECT_EQ(WEXITSTATUS(stop()), 0);
  EXPECT_EQ(backplane_.segmentNames().size(), 0U) << "each process was supervised, and has ended";
}

TEST_F(SupervisorTest, KillsAProcessThatDoesNotEnd) {
  run("[[program]]\nname = \"deaf\"\ncommand = [\"/bin/sh\", \"-c\", \"trap '' TERM; echo on; "
      "while :; do sleep 1000 & wait; done\"]\nstop-time = \"50ms\"\n");
  ASSERT_NE(supervisor_->waitForLine("deaf | on"), "");

  ask({{"do", "stop"}, {"name", "deaf"}});
  waitForState("deaf", "stopped");

  EXPECT_EQ(pidOf("deaf"), 0);
}

TEST_F(SupervisorTest, ReapsTheProcessesThatOthersLeave) {
  const auto file = files_.file("orphan");
  run("[[program]]\nname = \"parent\"\ncommand = [\"/bin/sh\", \"-c\", \"(sh -c 'echo $$ > " +
      file + ".new; mv " + file + ".new " + file + "' &); exec sleep 1000\"]\n");
  while (!std::filesystem::exists(file)) continue;
  const auto orphan = std::stoi(readWholeFile(file));

  while (::kill(orphan, 0) == 0) continue;  // a process that is not reaped still has its pid

  EXPECT_EQ(stateOf("parent"), "ready");
}

TEST_F(SupervisorTest, PrintsTheLinesOfItsProcesses) {
  run("[[program]]\nname = \"talker\"\ncommand = [\"/bin/sh\", \"-c\", \"echo one; exec sleep "
      "1000\"]\n");

  EXPECT_EQ(supervisor_->waitForLine("one"), "talker | one");
  waitForState("talker", "ready");
  EXPECT_THAT(runCommand(MPF " logs talker").output,
              testing::MatchesRegex("-- [-0-9]+ [0-9:]+ started, pid [0-9]+\none\n"));
}

TEST_F(SupervisorTest, AProcessThatDiesDuringTheShutdownIsNotStartedAgain) {
  run(kServer +
      "[[program]]\nname = \"user\"\nneeds = [\"int32\"]\n"
      "command = [\"sh\", \"-c\", \"trap '' TERM; echo on; exec sleep 1000\"]\n");
  ASSERT_NE(supervisor_->waitForLine("user | on"), "");
  const auto user = pidOf("user");
  supervisor_->signal(SIGTERM);
  waitForState("user", "stopping");

  ::kill(pidOf("int32"), SIGKILL);

  waitForState("int32", "stopped");
  ::kill(user, SIGKILL);
  EXPECT_EQ(WEXITSTATUS(supervisor_->wait()), 0);
  supervisor_.reset();
}

TEST_F(SupervisorTest, OneCrateHasOneSupervisor) {
  run(kServer);

  const auto second = runCommand(std::string(MPF) + " run " + files_.file("lab.toml") + " 2>&1");

  EXPECT_EQ(WEXITSTATUS(second.status), 1);
  EXPECT_THAT(second.output, HasSubstr("the crate \"lab\" is already running"));
}

TEST_F(SupervisorTest, CommandsOfTheShellControlIt) {
  run(kServer);
  waitForState("int32", "ready");
  const std::string mpf = MPF;

  EXPECT_THAT(runCommand(mpf + " ps").output, testing::ContainsRegex("int32 +ready"));
  EXPECT_EQ(runCommand(mpf + " restart int32 --wait 900").output, "int32 is ready\n");
  EXPECT_EQ(runCommand(mpf + " stop int32 --wait 900").output, "int32 is stopped\n");
  EXPECT_EQ(runCommand(mpf + " start int32 --wait 900").output, "int32 is ready\n");
  EXPECT_EQ(nlohmann::json::parse(runCommand(mpf + " ps --json").output)[0].at("crate"), "lab");
  EXPECT_EQ(runCommand(mpf + " stop --wait 900").output, "the crate \"lab\" has stopped\n");
  EXPECT_EQ(WEXITSTATUS(supervisor_->wait()), 0);
  supervisor_.reset();
  EXPECT_THAT(runCommand(mpf + " stop 2>&1").output, HasSubstr("no crate is running"));
}

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
