// SPDX-License-Identifier: MIT
// readCrate(): every key of a crate file, and the place and text of each error.
#include "crate/config/read_crate.h"

#include "tests/crate/config/crate_text.h"

// NOLINTBEGIN(modernize-raw-string-literal): a test case is one line
namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

using ReadCrateTest = CrateTextTest;

TEST_F(ReadCrateTest, AFewLinesAreEnough) {
  const auto crate = read("[[server]]\nprogram = \"int32\"\n");

  EXPECT_EQ(crate.name, "lab");
  EXPECT_EQ(crate.file, folder_.file("lab.toml"));
  ASSERT_EQ(crate.processes.size(), 1U);
  EXPECT_EQ(crate.processes[0].name, "int32");
}

TEST_F(ReadCrateTest, ReadsEveryKey) {
  const auto crate = read(R"(
name = "beamline"
backplane = "lab"
location = 3
mode = "0660"
group = "users"
log-level = "debug"
wait-mode = "block"
user = "operator"

[environment]
A = "a"
B = 2

[supervision]
restart = "on-failure"
start-time = "5s"
stop-time = "1s"
stall-limit = "off"
busy-limit = "1min"
first-pause = "10ms"
last-pause = "1min"
max-restarts = 3
restart-window = "30s"

[capsules]
count = 7
size = "2MiB"

[logs]
size = "1MiB"

[carriers]
ipac = "model"

[[server]]
name = "uart"
program = "serial"
octal-uart = {module = "UART0", carrier = "ipac", site = "IP_a", nports = 8}
octal-port = [{port = "UART0[0]", module = "UART0", n = 0, flow = "H"}, "UART0[1],UART0,1"]
server = [{server = "a", port = "UART0[0]", eomstr = "\\r"}]
octal-timing = true
settle-time = "7ms"
needs = ["router"]
location = 4
user = "root"
working-folder = "data"
environment = {C = "c"}
restart = "never"
arguments = ["--quiet-time=3"]

[[router]]
name = "router"
serve = "1=0"
listen = ["a:1", "b:2"]
plain = true

[[ioc]]
startup = "st.cmd"
database = ["a.db", "b.db"]
servers = ["extra"]

[[program]]
name = "viewer"
command = ["viewer", "--all"]
)");

  EXPECT_EQ(crate.name, "beamline");
  EXPECT_EQ(crate.backplane, "lab");
  EXPECT_EQ(crate.location, 3);
  EXPECT_EQ(crate.defaults.size(), 4U);
  EXPECT_EQ(crate.user, "operator");
  EXPECT_THAT(crate.environment, ElementsAre(Pair("A", "a"), Pair("B", "2")));
  EXPECT_EQ(crate.supervision.restart, Restart::onFailure);
  EXPECT_EQ(crate.supervision.startTime, 5s);
  EXPECT_EQ(crate.supervision.stopTime, 1s);
  EXPECT_EQ(crate.supervision.stallLimit, 0ms);
  EXPECT_EQ(crate.supervision.busyLimit, 1min);
  EXPECT_EQ(crate.supervision.firstPause, 10ms);
  EXPECT_EQ(crate.supervision.lastPause, 1min);
  EXPECT_EQ(crate.supervision.maxRestarts, 3);
  EXPECT_EQ(crate.supervision.restartWindow, 30s);
  EXPECT_EQ(crate.maxCapsules, 7);
  EXPECT_EQ(crate.maxCapsuleBytes, 2u << 20);
  EXPECT_EQ(crate.maxLogBytes, 1u << 20);
  ASSERT_EQ(crate.carriers.size(), 1U);
  EXPECT_EQ(crate.carriers[0].kind, "model");
  ASSERT_EQ(crate.processes.size(), 4U);
  const auto& uart = crate.processes[0];
  EXPECT_THAT(uart.find("octal-uart")->values, ElementsAre("UART0,ipac,IP_a,8"));
  EXPECT_THAT(uart.find("octal-port")->values,
              ElementsAre("UART0[0],UART0,0,,,,,H", "UART0[1],UART0,1"));
  EXPECT_THAT(uart.find("server")->values, ElementsAre("a,UART0[0],,,\\r"));
  EXPECT_EQ(uart.valueOf("octal-timing"), "true");
  EXPECT_EQ(uart.valueOf("settle-time"), "7ms");
  EXPECT_THAT(uart.needs, ElementsAre("router"));
  EXPECT_EQ(uart.location, 4);
  EXPECT_EQ(uart.user, "root");
  EXPECT_EQ(uart.workingFolder, "data");
  EXPECT_THAT(uart.environment, ElementsAre(Pair("C", "c")));
  EXPECT_EQ(uart.supervision.restart, Restart::never);
  EXPECT_THAT(uart.command, ElementsAre("--quiet-time=3"));
  EXPECT_THAT(crate.processes[1].find("listen")->values, ElementsAre("a:1", "b:2"));
  EXPECT_THAT(crate.processes[2].servers, ElementsAre("extra"));
  EXPECT_THAT(crate.processes[3].command, ElementsAre("viewer", "--all"));
}

TEST_F(ReadCrateTest, AProcessIsNamedForItsModuleOrServer) {
  const auto crate = read(
      "[carriers]\nipac = \"model\"\n[[server]]\nprogram = \"dac128v\"\nmodule = \"d-DAC\"\n"
      "carrier = \"ipac\"\nsite = \"IP_d\"\n[[server]]\nprogram = \"serial\"\n"
      "server = [\"a[0],/dev/a\"]\n");

  EXPECT_EQ(crate.processes[0].name, "d-DAC");
  EXPECT_EQ(crate.processes[1].name, "a[0]");
}

TEST_F(ReadCrateTest, ReportsAllErrorsAtOnce) {
  EXPECT_EQ(errorsOf("locatoin = 1\n[supervision]\nstall-limit = 5\n[[server]]\nprogram = \"dac\"\n"
                     "[[server]]\nprogram = \"int32\"\nsevrer = \"x\"\n"),
            "lab.toml:1:1: unknown key \"locatoin\"; did you mean \"location\"?\n"
            "lab.toml:3:15: stall-limit: \"5\": write a time with its unit, such as 500ms, 2s or "
            "1min, or off\n"
            "lab.toml:5:11: unknown program \"dac\"; the programs are serial, gpib, dac128v, "
            "digital-io, ip330, ip440, int32, char8-array; a program that is not one of MPF is a "
            "[[program]] with its command\n"
            "lab.toml:8:1: [[server]]: unknown key \"sevrer\"; did you mean \"server\"?");
}

TEST_F(ReadCrateTest, ErrorsSayWhatToWrite) {
  EXPECT_THAT(errorsOf("[[server]]\nname = \"a\"\n"),
              HasSubstr("lab.toml:1:1: [[server]] has no program; write program = \"serial\""));
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"int32\"\nserver = {a = 1}\n"),
              HasSubstr("lab.toml:3:10: server is a table; write a text or a number"));
  EXPECT_THAT(
      errorsOf("[[server]]\nprogram = \"serial\"\nserver = [{server = \"a\", prot = \"b\"}]\n"),
      HasSubstr("lab.toml:3:26: server: unknown key \"prot\"; did you mean \"port\"?"));
  EXPECT_THAT(
      errorsOf("[[server]]\nprogram = \"serial\"\nserver = [{server = \"a\", eomstr = \"\"}]\n"),
      HasSubstr("lab.toml:3:35: eomstr of server is empty; leave it out for its default"));
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"serial\"\nserver = \"a\"\nport = \"b\"\n"
                       "octal-timing = 1\n"),
              HasSubstr("lab.toml:5:16: octal-timing is an integer; write true or false"));
  EXPECT_THAT(errorsOf("[carriers]\nipac = 1\n"),
              HasSubstr("lab.toml:2:8: ipac is an integer; write a string in quotes"));
  EXPECT_THAT(
      errorsOf("[logs]\nsize = \"10MB\"\n"),
      HasSubstr("lab.toml:2:8: size: \"10MB\": write a size, such as 4096, 64KiB or 10MiB"));
  EXPECT_THAT(errorsOf("[supervision]\nrestart = \"yes\"\n"),
              HasSubstr("\"yes\": write \"always\", \"on-failure\" or \"never\""));
  EXPECT_THAT(errorsOf("[[program]]\nname = \"a\"\n"),
              HasSubstr("[[program]] has no command; write command = [\"viewer\", \"--all\"]"));
}

TEST(ParseDuration, NeedsAUnit) {
  EXPECT_EQ(parseDuration("500ms"), 500ms);
  EXPECT_EQ(parseDuration("2s"), 2s);
  EXPECT_EQ(parseDuration("3min"), 3min);
  EXPECT_EQ(parseDuration("1.5min"), 90s);
  EXPECT_EQ(parseDuration("0.5ms"), 1ms) << "rounded up";
  for (const auto* const text : {"", "5", "s", "0s", "-1s", "1h", "1 s", "99999999999s", "off"})
    EXPECT_THROW(static_cast<void>(parseDuration(text)), std::invalid_argument) << text;
}

TEST_F(ReadCrateTest, OnlyTheLimitsOfServersCanBeOff) {
  EXPECT_EQ(parseDurationOrOff("off"), 0ms);
  EXPECT_EQ(parseDurationOrOff("2s"), 2s);
  for (const std::string key : {"stall-limit", "busy-limit"})
    EXPECT_THAT(
        errorsOf("[supervision]\n" + key + " = \"5\"\n"),
        HasSubstr(key +
                  ": \"5\": write a time with its unit, such as 500ms, 2s or 1min, or off\n"));
  for (const std::string key :
       {"start-time", "stop-time", "first-pause", "last-pause", "restart-window"})
    EXPECT_THAT(errorsOf("[supervision]\n" + key + " = \"off\"\n"),
                HasSubstr(key + ": \"off\": write a time with its unit, such as 500ms, 2s or "
                                "1min\n"));
}

TEST_F(ReadCrateTest, AKeyOfAnotherTableIsNamedWithItsTable) {
  const std::string server = "[[server]]\nprogram = \"int32\"\n";

  EXPECT_THAT(
      errorsOf("stall-limit = \"2s\"\n" + server),
      HasSubstr("unknown key \"stall-limit\"; it belongs to [supervision], or to a process"));
  EXPECT_THAT(
      errorsOf("busy-limit = \"2s\"\n" + server),
      HasSubstr("unknown key \"busy-limit\"; it belongs to [supervision], or to a process"));
  EXPECT_THAT(errorsOf("needs = [\"a\"]\n" + server), HasSubstr("it belongs to a process"));
  EXPECT_THAT(errorsOf(server + "baud = 9600\n"),
              HasSubstr("unknown key \"baud\"; it belongs to [[server]] of program \"serial\""));
  EXPECT_THAT(errorsOf(server + "backplane = \"b\"\n"),
              HasSubstr("it belongs to the top of the file"));
  EXPECT_THAT(errorsOf("[supervision]\nlisten = \"*:1\"\n" + server),
              HasSubstr("it belongs to [[router]]"));
  EXPECT_THAT(errorsOf(server + "queuesize = 7\n"), HasSubstr("did you mean \"queue-size\"?"));
}

TEST_F(ReadCrateTest, TextsWithNulAreRefused) {
  for (const std::string line :
       {R"(command = ["a\u0000b"])", R"(command = "a\u0000b")",
        "command = \"a\"\nenvironment = {A = \"\\u0000\"}", "command = \"a\"\nuser = \"\\u0000\""})
    EXPECT_THAT(errorsOf("[[program]]\nname = \"x\"\n" + line + "\n"),
                HasSubstr("the text contains the character \\u0000"))
        << line;
  EXPECT_THAT(errorsOf("[environment]\n\"A\\u0000\" = 1\n[[server]]\nprogram = \"int32\"\n"),
              HasSubstr("lab.toml:2:13: the key of this value contains the character \\u0000"));
}

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
