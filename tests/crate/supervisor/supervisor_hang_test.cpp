// SPDX-License-Identifier: MIT
// Supervisor: processes whose servers stall, or work on one request for ever.
#include <fcntl.h>
#include <sys/stat.h>

#include <mpf/file_descriptor.h>

#include "tests/crate/supervisor/supervisor_fixture.h"

// NOLINTBEGIN(modernize-raw-string-literal): a crate is one line
namespace mpf::crate::test {
namespace {

using mpf::test::runCommand;
using testing::HasSubstr;

// A server "victim" that works for ever on an Int32 with the cmd 11.
std::string hangingServer(const std::string& backplane) {
  return fmt::format(
      "[[program]]\nname = \"one\"\ncommand = [\"{}\", \"{}\"]\n"
      "servers = [\"victim\"]\n",
      MPF_TEST_CRASHING_SERVER, backplane);
}

// Its folder is on a host that does not answer, for example.
TEST_F(SupervisorTest, AnswersWhileAProcessWaitsBeforeItsProgramIsExecuted) {
  const auto held = files_.file("held");
  ASSERT_EQ(::mkfifo(held.c_str(), 0600), 0);
  write(kServer);
  start({"/usr/bin/env", "MPF_TEST_HELD=" + held, "LD_PRELOAD=" MPF_TEST_HELD_START, MPF, "run",
         files_.file("lab.toml")});

  EXPECT_EQ(stateOf("int32"), "starting");

  const FileDescriptor opened(::open(held.c_str(), O_WRONLY | O_CLOEXEC));
  waitForState("int32", "ready");
}

TEST_F(SupervisorTest, RestartsAServerThatIsStalled) {
  run(kServer, "stall-limit = \"100ms\"\n");
  waitForState("int32", "ready");
  const auto before = pidOf("int32");
  mpf::test::Program client({MPF, "call", "Int32", "int32", "--count", "1000000000"});
  ::kill(before, SIGSTOP);

  waitForNew("int32", before);

  EXPECT_THAT(process("int32").at("reason").get<std::string>(), HasSubstr("stalled for"));
}

TEST_F(SupervisorTest, RestartsAServerThatIsBusyForTooLong) {
  run(hangingServer(backplane_.name()), "busy-limit = \"100ms\"\n");
  waitForState("one", "ready");
  const auto before = pidOf("one");
  mpf::test::Program client({MPF, "call", "victim", "int32", "cmd=11"});

  waitForNew("one", before);

  EXPECT_THAT(process("one").at("reason").get<std::string>(),
              testing::MatchesRegex("busy with int32 cmd=11 for [0-9.]+ m?s"));
  EXPECT_THAT(runCommand(MPF " capsule").output,
              HasSubstr("\"one\" was busy for too long and was ended"));
}

TEST_F(SupervisorTest, ShowsTheRequestOfABusyServer) {
  run(hangingServer(backplane_.name()));
  waitForState("one", "ready");
  mpf::test::Program client({MPF, "call", "victim", "int32", "cmd=11"});

  auto report = process("one");
  while (report.at("state") != "busy")
    report = nlohmann::json::parse(runCommand(MPF " ps --json").output)[0].at("processes")[0];
  const auto text = runCommand(MPF " ps").output;
  ::kill(pidOf("one"), SIGKILL);  // it would not handle SIGTERM

  const auto& work = report.at("handling");
  EXPECT_EQ(work.at("server"), "victim");
  EXPECT_EQ(work.at("type"), "int32");
  EXPECT_EQ(work.at("cmd"), 11);
  EXPECT_GE(work.at("for_s"), 1);
  EXPECT_THAT(
      text, testing::ContainsRegex("  one +busy .*\n  busy: one, server victim, with int32 cmd=11 "
                                   "for [0-9.]+ s\n"));
}

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
