// SPDX-License-Identifier: MIT
// Usage, errors and exit status of `mpf`.
#include <set>

#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr std::array<const char*, 23> kSubcommands{
    "run",        "new", "ps",     "logs",  "capsule", "stop",    "start", "restart",
    "reload",     "ls",  "mrr",    "msr",   "top",     "inspect", "call",  "sniff",
    "gpib-sniff", "tap", "replay", "clean", "doctor",  "torture", "bench"};

class CommandLineTest : public ToolsTest {};

TEST_F(CommandLineTest, PrintsUsageWithoutArguments) {
  const auto ended = run({});

  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.out, IsEmpty());
  EXPECT_THAT(ended.err, StartsWith("mpf - runs servers, shows backplanes, servers and clients"));
  for (const auto* name : kSubcommands)
    EXPECT_THAT(ended.err, HasSubstr(std::string("\n  ") + name + " "));
}

TEST_F(CommandLineTest, HelpGoesToStdout) {
  const auto ended = run({"--help"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.err, IsEmpty());
  for (const auto* name : kSubcommands)
    EXPECT_THAT(ended.out, HasSubstr(std::string("\n  ") + name + " "));
  EXPECT_THAT(ended.out, AllOf(HasSubstr("MPF_BACKPLANE"), HasSubstr("MPF_LOCATION"),
                               HasSubstr("Exit status: 0 success")));
}

TEST_F(CommandLineTest, EachSubcommandHasHelp) {
  for (const std::string name : kSubcommands) {
    if (name == "bench") continue;  // a program of its own

    const auto ended = run({name, "--help"});

    EXPECT_EQ(ended.status, 0) << name;
    EXPECT_THAT(ended.out, HasSubstr("Usage: mpf " + name)) << name;
    // doctor looks at the host, torture has a backplane of its own, crates have theirs in a file.
    const std::set<std::string> others{"doctor",  "torture", "run",   "new",     "ps",    "logs",
                                       "capsule", "stop",    "start", "restart", "reload"};
    const bool hasBackplane = !others.contains(name);
    EXPECT_EQ(ended.out.find("--backplane") != std::string::npos, hasBackplane) << name;
    EXPECT_THAT(ended.err, IsEmpty()) << name;
  }
}

TEST_F(CommandLineTest, AnUnknownSubcommandIsAnErrorThatListsAll) {
  const auto ended = run({"unknown", "--json"});

  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.out, IsEmpty());
  EXPECT_EQ(ended.err,
            "mpf: unknown subcommand or option \"unknown\"; the subcommands are run, new, convert, "
            "ps, logs, "
            "capsule, stop, start, restart, reload, ls, mrr, msr, top, inspect, "
            "call, sniff, gpib-sniff, tap, replay, clean, doctor, torture, "
            "bench; "
            "`mpf --help` shows what they do\n");
}

struct Wrong {
  std::vector<std::string> words;
  std::string text;
};

// Each error names the wrong argument and the help.
TEST_F(CommandLineTest, RefusesWrongArguments) {
  const std::vector<Wrong> wrong{
      {{"ls", "--jason"},
       "mpf ls: The following argument was not expected: --jason; `mpf ls --help`"},
      {{"ls", "--interval", "0"},
       "mpf ls: --interval: 0 is out of range: use 1ms to 60min; `mpf ls"},
      {{"ls", "lab"},
       "mpf ls: The following argument was not expected: lab; a backplane is named with "
       "--backplane lab; `mpf ls --help`"},
      {{"msr", "a", "b"}, "mpf msr: The following argument was not expected: b; `mpf msr --help`"},
      {{"call"}, "mpf call: server is required; `mpf call --help`"},
      {{"call", "echo"}, "mpf call: type is required; `mpf call --help`"},
      {{"call", "echo", "int32", "--count", "0"},
       "mpf call: --count: 0 is out of range: use 1 to 9007199254740992;"},
      {{"call", "echo", "int32", "--timeout", "0"},
       "mpf call: --timeout: 0 is out of range: use more than 0s; `mpf call"},
      {{"call", "echo", "int32", "--timeout", "nan"}, "mpf call: --timeout: nan is not a time"},
      {{"call", "echo", "int32", "--interval", "-1"},
       "mpf call: --interval: -1 is not a time: use 200ms, 2s or 1.5min; a number without a unit "
       "is in seconds"},
      {{"call", "echo", "int32", "--follow", "1e300"}, "mpf call: --follow: 1e300 is not a time"},
      {{"call", "echo", "int32", "--location", "here"},
       "mpf call: Could not convert: --location = here"},
      {{"replay", "/dev/null", "--speed", "-1"},
       "mpf replay: --speed: -1 is out of range: use 0 to 1000000; `mpf replay --help`"},
      {{"replay", "/dev/null", "--speed", "nan"},
       "mpf replay: --speed: nan is out of range: use 0 to 1000000;"},
      {{"tap", "echo", "--count", "-1"}, "mpf tap: --count: -1 is out of range: use 0 or more;"},
      {{"inspect", "--last", "-3"}, "mpf inspect: --last: -3 is out of range: use 0 to 65536;"},
      {{"top", "--batch", "0"}, "mpf top: --batch: 0 is out of range: use 1 to 1000000000;"},
      {{"torture", "--hit", "0"}, "mpf torture: --hit: 0 is out of range: use 1 or more;"},
      {{"torture", "--instructions", "-1"},
       "mpf torture: --instructions: -1 is out of range: use 0 or more;"},
      {{"torture", "--role", "router"}, "mpf torture: --role: router not in {client,server};"},
      {{"torture", "--mode", "0"}, "mpf torture: --mode: 0 not in {kill,stop};"},
      {{"tap", "echo", "--write", "/nonexistent/x", "--json"}, "mpf tap: --write excludes --json"},
      {{"tap", "echo", "--write", "/nonexistent/x", "--print"},
       "mpf tap: --write excludes --print"},
      {{"top", "--batch", "1", "--interval", "60min", "--sort", "COLOUR"},
       "mpf top: no column \"COLOUR\""},
      {{"sniff"}, "mpf sniff: server is required; `mpf sniff --help`"},
      {{"gpib-sniff", "gpib", "--json", "--decode"}, "mpf gpib-sniff: --decode excludes --json"},
      {{"sniff", "serial[0]", "soon"}, "mpf sniff: seconds: soon is not a time"},
      {{"sniff", "serial[0]", "--format", "hex"}, "mpf sniff: --format: hex not in {lines,manual}"},
  };
  for (const auto& [words, text] : wrong) {
    const auto ended = run(words);

    EXPECT_EQ(ended.status, 2) << text;
    EXPECT_THAT(ended.err, StartsWith(text));
    EXPECT_THAT(ended.out, IsEmpty());
  }
}

TEST_F(CommandLineTest, RefusesInvalidNames) {
  for (const std::string name : {"ls", "mrr", "msr", "top", "inspect", "clean"}) {
    const auto ended = run({name, "--backplane", "a.b"});
    EXPECT_EQ(ended.status, 2);
    EXPECT_EQ(ended.err,
              "mpf " + name +
                  ": backplane name \"a.b\": use 1 to 39 of the characters A-Z a-z 0-9 _ -\n");
  }
  EXPECT_EQ(runTool({"call", "echo", "int32"}, "a/b").err,
            "mpf call: backplane name \"a/b\": use 1 to 39 of the characters A-Z a-z 0-9 _ -\n");

  const auto ended = run({"call", std::string(64, 'x'), "int32"});

  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.err, HasSubstr("use 1 to 63 bytes without control characters"));
}

}  // namespace
}  // namespace mpf::test
