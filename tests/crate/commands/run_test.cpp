// SPDX-License-Identifier: MIT
// mpf run and mpf new: names that cannot be names of folders and files; errors that are found
// before anything is started.
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <grp.h>
#include <regex>

#include "base/program_beside.h"
#include "base/whole_file.h"
#include "tests/crate/supervisor/supervisor_fixture.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class RunTest : public SupervisorTest {
 protected:
  mpf::test::EndedCommand mpf(const std::string& arguments) {
    return mpf::test::runCommand(
        fmt::format("cd {} && {} {} 2>&1", files_.path().string(), MPF, arguments));
  }
};

TEST_F(RunTest, RefusesANameThatLeavesTheFolderOfCrates) {
  write(kServer);
  for (const std::string option : {"", " --check", " --dry-run"}) {
    const auto result = mpf("run --name ../../x lab.toml" + option);

    EXPECT_EQ(WEXITSTATUS(result.status), 2);
    EXPECT_THAT(result.output, HasSubstr("--name \"../../x\": use 1 to 100 characters"));
  }
  EXPECT_EQ(mpf("run --name x --check lab.toml").status, 0);
}

TEST_F(RunTest, ADryRunPrintsTheFolderOfEachCommand) {
  write(kServer + "working-folder = \"/\"\n");

  EXPECT_THAT(mpf("run --dry-run lab.toml").output, HasSubstr("# int32, in /\n"));
  EXPECT_THAT(mpf("run --check lab.toml").output, HasSubstr("lab.toml: 1 process, no error"));
}

TEST_F(RunTest, ANewCrateHasANameThatItsCheckAccepts) {
  for (const std::string name : {"'a b'", "''", ".a", "a/"}) {
    const auto result = mpf("new crate " + name);

    EXPECT_EQ(WEXITSTATUS(result.status), 2) << name;
    EXPECT_THAT(result.output, HasSubstr("use 1 to 100 characters"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(files_.path()));
  std::filesystem::create_directory(files_.path() / "folder");
  EXPECT_EQ(mpf("new crate folder/a").status, 0);
  EXPECT_EQ(mpf("run --check folder/a.toml").status, 0);
}

TEST_F(RunTest, TheExamplesInANewCrateAreRight) {
  ASSERT_EQ(mpf("new crate lab").status, 0);
  auto text = readWholeFile(files_.file("lab.toml"));
  const auto without = [&](const std::string& what, const std::string& with) {
    text = std::regex_replace(text, std::regex(what), with);
  };
  const auto* group = ::getgrgid(::getegid());  // NOLINT(concurrency-mt-unsafe)
  ASSERT_NE(group, nullptr);
  without(R"(\n# (\[\[|[a-z-]+ = ))", "\n$1");  // makes comments to entries
  without("group = \"mpf\"", std::string("group = \"") + group->gr_name + "\"");
  if (!std::filesystem::exists(programBeside("mpf-ioc"))) without(R"(\[\[ioc\]\][^[]*$)", "");
  static_cast<void>(files_.write("lab.db", "record(ai, \"$(P)v\") {}\n"));
  static_cast<void>(files_.write("lab.toml", text));

  const auto result = mpf("run --check lab.toml");

  EXPECT_THAT(text, HasSubstr("\n[[router]]"));
  EXPECT_THAT(result.output, HasSubstr("processes, no error")) << text;
}

TEST_F(RunTest, ARefusedRunOfAStartupFileChangesNothing) {
  start({MPF, "run", "--name", "lab", files_.write("st.cmd", "iocInit\n")});
  const auto before = readWholeFile(folder().file("ioc.cmd"));
  static_cast<void>(files_.write("other.cmd", "iocInit\nmrr\n"));

  const auto result = mpf("run --name lab other.cmd");

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output, HasSubstr("the crate \"lab\" is already running"));
  EXPECT_EQ(readWholeFile(folder().file("ioc.cmd")), before);
}

// The file that would replace the commands of the IOC cannot be written.
TEST_F(RunTest, AReloadOnAFullDiskKeepsTheCommandsOfTheIoc) {
  start({MPF, "run", "--name", "lab", files_.write("st.cmd", "iocInit\n")});
  const auto commands = folder().file("ioc.cmd");
  const auto before = readWholeFile(commands);
  static_cast<void>(files_.write("st.cmd", "iocInit\nmrr\n"));
  std::filesystem::create_symlink("/dev/full", commands + ".new");

  EXPECT_THAT([&] { ask({{"do", "reload"}}); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("No space left on device")));

  EXPECT_EQ(readWholeFile(commands), before);
}

// ---- errors that this host, or a program, finds

constexpr const char* kWrong = R"(backplane = "a b"
mode = "0999"
[carriers]
ipac = "modle"
[[server]]
program = "int32"
queue-size = 0
wait-mode = "fast"
[[server]]
program = "char8-array"
[[program]]
name = "absent"
command = "no-such-program 5"
[[program]]
name = "user"
command = ["true"]
user = "no-such-user"
[[program]]
name = "folder"
command = ["true"]
working-folder = "/no/such/folder"
[[router]]
file = "absent.toml"
)";

class RunCheckTest : public RunTest {
 protected:
  // The errors of a file, without its name.
  std::string errorsOf(const std::string& text) {
    static_cast<void>(files_.write("lab.toml", text));
    const auto result = mpf("run --check lab.toml");
    EXPECT_EQ(WEXITSTATUS(result.status), 2) << result.output;
    return std::regex_replace(result.output, std::regex("(mpf run: )?lab.toml:"), "");
  }
};

TEST_F(RunCheckTest, NamesUsersFoldersAndProgramsAreChecked) {
  const auto errors = errorsOf(kWrong);

  for (const std::string error :
       {"1:13: backplane name \"a b\"", "4:8: unknown carrier kind \"modle\"",
        "13:11: there is no program \"no-such-program 5\"; write command = [",
        "17:8: user \"no-such-user\": this host has no such user",
        "21:18: working-folder \"/no/such/folder\": this host has no such folder"})
    EXPECT_THAT(errors, HasSubstr(error));
}

TEST_F(RunCheckTest, ProgramsCheckTheirArguments) {
  const auto errors =
      errorsOf(std::regex_replace(std::string(kWrong), std::regex("\"a b\""), "\"ab\""));

  for (const std::string error :
       {"7:14: queue-size: 0 is out of range", "8:13: wait-mode: fast not in",
        "2:8: mode: 0999: use an octal number", "absent.toml: cannot be read"})
    EXPECT_THAT(errors, HasSubstr(error));
  EXPECT_EQ(errors.find("mode: 0999"), errors.rfind("mode: 0999"));  // of two servers
}

TEST_F(RunCheckTest, HardwareProgramsCheckTheirModules) {
  const auto errors = errorsOf(R"(carriers = {ipac = "model"}
[[server]]
program = "dac128v"
module = "dac"
carrier = "ipac"
site = "IP_x"
[[server]]
program = "ip330"
module = "adc"
carrier = "ipac"
site = "IP_b"
signal = "0=cosine:1"
)");

  EXPECT_THAT(errors, HasSubstr("6:8: site: carrier \"ipac\" has no \"IP_x\""));
  EXPECT_THAT(errors, HasSubstr("12:10: signal \"0=cosine:1\""));
}

TEST_F(RunCheckTest, AnOptionForAnUnknownCarrierIsAnError) {
  static_cast<void>(files_.write("lab.toml", "carriers = {ipac = \"model\"}\n" + kServer));
  static_cast<void>(files_.write("st.cmd",
                                 "ipacAddCarrier(&vipc616_01, \"0x3000,0xa0000000\")\n"
                                 "initIpacCarrier(\"ipac\", 0)\n"
                                 "initDAC128V(\"dac\", \"ipac\", \"IP_a\", 20)\n"));
  for (const std::string file : {"lab.toml", "st.cmd"}) {
    const auto result = mpf("run --check --carrier ipca=model " + file);

    EXPECT_EQ(WEXITSTATUS(result.status), 2) << result.output;
    EXPECT_THAT(result.output, HasSubstr("mpf run: --carrier ipca=model: "));
    EXPECT_THAT(result.output, HasSubstr("did you mean \"ipac\"?"));
    EXPECT_EQ(mpf("run --check --carrier ipac=model " + file).status, 0);
  }
}

TEST_F(RunCheckTest, ModelsAreOfTheUserOfTheSupervisor) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can start processes of other users";
  const std::string crate = R"(carriers = {ipac = "model"}
[[server]]
program = "dac128v"
module = "dac"
carrier = "ipac"
site = "IP_a"
user = ")";

  EXPECT_THAT(
      errorsOf(crate + "nobody\"\n"),
      HasSubstr("7:8: user \"nobody\": the process \"dac\" uses models (carrier \"ipac\")"));
  static_cast<void>(files_.write("lab.toml", crate + "root\"\n"));
  EXPECT_EQ(mpf("run --check lab.toml").status, 0);
}

TEST_F(RunCheckTest, AFileWithOtherErrorsIsCheckedAsWell) {
  const auto errors = errorsOf("colour = 1\n" + kServer + "queue-size = 0\n");

  EXPECT_THAT(errors, HasSubstr("1:1: unknown key \"colour\""));
  EXPECT_THAT(errors, HasSubstr("4:14: queue-size: 0 is out of range"));
}

TEST_F(RunCheckTest, TheProgramOfATableWithOtherErrorsIsCheckedAsWell) {
  const auto errors =
      errorsOf("[[program]]\nname = \"a\"\ncommand = \"./absent\"\nserver = \"b\"\n");

  EXPECT_THAT(errors, HasSubstr("3:11: there is no program \"./absent\""));
  EXPECT_THAT(errors, HasSubstr("4:1: [[program]]: unknown key \"server\""));
}

TEST_F(RunCheckTest, EachErrorBeginsWithTheCommand) {
  static_cast<void>(files_.write("lab.toml", "colour = 1\ncarriers = {ipac = \"modle\"}\n"));

  EXPECT_THAT(mpf("run --check lab.toml").output,
              testing::MatchesRegex("mpf run: lab.toml:1:1: unknown key .*\n"
                                    "mpf run: lab.toml:2:.*unknown carrier kind .*\n  model .*\n"
                                    "mpf run: .*lab.toml: the crate starts nothing.*\n"));
  EXPECT_THAT(mpf("run absent.toml").output, StartsWith("mpf run: absent.toml: cannot be read"));
  EXPECT_THAT(mpf("stop").output, StartsWith("mpf stop: no crate is running"));
  EXPECT_THAT(mpf("run --help").output, HasSubstr("2 usage error, or errors in the crate file"));
}

TEST_F(RunCheckTest, ACrateWithSuchErrorsIsNotStarted) {
  static_cast<void>(files_.write("lab.toml", kServer + "queue-size = 0\n"));

  const auto result = mpf("run lab.toml");

  EXPECT_EQ(WEXITSTATUS(result.status), 2);
  EXPECT_THAT(result.output, HasSubstr("queue-size: 0 is out of range"));
}

TEST_F(RunCheckTest, SuchErrorsAreFoundIfTheParentIgnoresTheEndsOfChildren) {
  static_cast<void>(files_.write("lab.toml", kServer + "queue-size = 0\n"));

  const auto result = mpf::test::runCommand("cd " + files_.path().string() +
                                            " && /usr/bin/env --ignore-signal=CHLD " MPF
                                            " run --check lab.toml 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 2);
  EXPECT_THAT(result.output, HasSubstr("queue-size: 0 is out of range"));
}

TEST_F(RunCheckTest, TheProgramsOfALargeCrateDoNotNeedADescriptorEach) {
  std::string text;
  for (int i = 0; i < 150; ++i)
    text += kServer + fmt::format("name = \"a{0}\"\nlocation = {0}\n", i);
  static_cast<void>(files_.write("lab.toml", text + "queue-size = 0\n"));

  const auto result = mpf::test::runCommand("ulimit -n 100; cd " + files_.path().string() +
                                            " && " MPF " run --check lab.toml 2>&1");

  EXPECT_EQ(WEXITSTATUS(result.status), 2);
  EXPECT_THAT(result.output, HasSubstr("queue-size: 0 is out of range"));
  EXPECT_THAT(result.output, testing::Not(HasSubstr("pipe2")));
}

TEST_F(RunCheckTest, AReloadWithSuchErrorsChangesNothing) {
  run(kServer);
  waitForState("int32", "ready");
  const auto pid = pidOf("int32");
  write(kServer + "queue-size = 0\n");

  EXPECT_THAT([&] { ask({{"do", "reload"}}); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("queue-size: 0 is out of")));

  EXPECT_EQ(pidOf("int32"), pid);
}

}  // namespace
}  // namespace mpf::crate::test
