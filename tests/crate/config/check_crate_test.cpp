// SPDX-License-Identifier: MIT
// checkCrate(): errors that concern several entries.
#include "tests/crate/config/crate_text.h"

// NOLINTBEGIN(modernize-raw-string-literal): a test case is one line
namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

const std::string kOne = "[[server]]\nprogram = \"int32\"\nserver = \"one\"\n";
const std::string kCarrier = "[carriers]\nipac = \"model\"\n";
const std::string kDac =
    "[[server]]\nprogram = \"dac128v\"\nmodule = \"dac\"\ncarrier = \"ipac\"\nsite = \"IP_a\"\n";

using CheckCrateTest = CrateTextTest;

TEST_F(CheckCrateTest, AnEmptyCrateStartsNothing) {
  EXPECT_THAT(errorsOf(""), HasSubstr("the crate starts nothing; write a [[server]]"));
}

TEST_F(CheckCrateTest, NamesAreUnique) {
  EXPECT_THAT(errorsOf(kOne + "name = \"a\"\n" + kOne + "name = \"a\"\nservers = [\"two\"]\n"),
              HasSubstr("lab.toml:8:8: the process \"a\" of"));
  for (const std::string name : {"a/b", "", "..", "a b"})
    EXPECT_THAT(errorsOf("name = \"" + name + "\"\n" + kOne),
                HasSubstr("name \"" + name + "\": use 1 to 100"));
  EXPECT_THAT(errorsOf(kOne + "name = \"a/b\"\n"), HasSubstr("name \"a/b\": use 1 to 100"));
}

TEST_F(CheckCrateTest, AServerIsInOneProcess) {
  EXPECT_THAT(errorsOf(kOne + "name = \"a\"\n" + kOne + "name = \"b\"\n"),
              HasSubstr("the server \"one\" is also in the process \"a\""));
}

TEST_F(CheckCrateTest, TheSameServerMayBeAtTwoLocations) {
  EXPECT_EQ(errorsOf(kOne + "name = \"a\"\nlocation = 1\n" + kOne + "name = \"b\"\n"), "");
  EXPECT_THAT(
      errorsOf("location = 1\n" + kOne + "name = \"a\"\nlocation = 1\n" + kOne + "name = \"b\"\n"),
      HasSubstr("each name can be served once at a location"));
}

TEST_F(CheckCrateTest, VariablesThatTheCrateSetsAreRefused) {
  EXPECT_THAT(errorsOf(kOne + "environment = {MPF_BACKPLANE = \"x\"}\n"),
              HasSubstr("lab.toml:4:15: environment: variable \"MPF_BACKPLANE\": it is set by the "
                        "crate; write backplane = \"NAME\""));
  EXPECT_THAT(errorsOf("[environment]\nMPF_LOCATION = 1\n" + kOne),
              HasSubstr("lab.toml:1:1: environment: variable \"MPF_LOCATION\": it is set by the "
                        "crate; write location = NUMBER"));
  EXPECT_THAT(errorsOf(kOne + "environment = {NOTIFY_SOCKET = \"x\"}\n"),
              HasSubstr("it is set by the supervisor"));
}

TEST_F(CheckCrateTest, NamesOfVariablesThatNoProgramCanReceiveAreRefused) {
  EXPECT_THAT(errorsOf(kOne + "environment = {\"\" = \"x\"}\n"),
              HasSubstr("variable \"\": a name must not be empty"));
  EXPECT_THAT(errorsOf(kOne + "environment = {\"A=B\" = \"x\"}\n"),
              HasSubstr("variable \"A=B\": a name must not be empty and must not contain \"=\""));
}

TEST_F(CheckCrateTest, AnArgumentWithoutAnOptionIsOneValue) {
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"int32\"\nserver = [\"a\", \"b\"]\n"),
              HasSubstr("lab.toml:3:10: server is a list of 2 values, but the program takes one "
                        "value here; write server = \"...\""));
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"int32\"\nserver = []\n"),
              HasSubstr("lab.toml:3:10: server is an empty list; write at least one value"));
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"serial\"\nport = \"/dev/a\"\n"
                       "server = [\"a\", \"b\"]\n"),
              HasSubstr("lab.toml:4:10: server is a list of 2 values"));
  EXPECT_EQ(errorsOf("[[server]]\nprogram = \"int32\"\nserver = [\"a\"]\n"), "");
}

TEST_F(CheckCrateTest, RequiredValues) {
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"dac128v\"\nmodule = \"dac\"\n"),
              HasSubstr("lab.toml:1:1: [[server]] of program \"dac128v\" has no carrier"));
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"serial\"\n"), HasSubstr("has no server; write"));
  EXPECT_THAT(errorsOf("[[router]]\n"), HasSubstr("[[router]] has nothing to do"));
}

TEST_F(CheckCrateTest, AnArgumentNeedsThoseBeforeIt) {
  EXPECT_THAT(errorsOf("[[server]]\nprogram = \"serial\"\nserver = \"a\"\nport = \"b\"\n"
                       "queuesize = 3\n"),
              HasSubstr("lab.toml:5:13: queuesize needs bufsize, too"));
}

TEST_F(CheckCrateTest, NeedsNameProcesses) {
  EXPECT_THAT(errorsOf(kOne + "needs = [\"onee\"]\n"),
              HasSubstr("lab.toml:4:9: needs \"onee\": no process has this name; did you mean "
                        "\"one\"?"));
  EXPECT_THAT(errorsOf(kOne + "needs = [\"b\"]\n[[program]]\nname = \"b\"\ncommand = \"b\"\n"
                              "needs = [\"one\"]\n"),
              HasSubstr("the needs form a cycle: one needs b needs one"));
}

// Each process needs all earlier ones: there are 2^60 paths.
TEST_F(CheckCrateTest, ManyNeedsTakeNoLongTime) {
  std::string crate;
  std::string needs;
  for (int i = 0; i < 60; ++i) {
    const auto name = "\"p" + std::to_string(i) + "\"";
    crate += "[[program]]\nname = " + name + "\ncommand = \"a\"\n";
    if (!needs.empty()) crate += "needs = [" + needs + "]\n";
    needs += (needs.empty() ? "" : ", ") + name;
  }

  EXPECT_EQ(errorsOf(crate), "");
}

TEST_F(CheckCrateTest, ACycleBehindOtherProcessesIsReported) {
  const auto program = [](const std::string& name, const std::string& needs) {
    return "[[program]]\nname = \"" + name + "\"\ncommand = \"a\"\nneeds = [" + needs + "]\n";
  };
  EXPECT_THAT(errorsOf(program("a", "\"b\", \"c\"") + program("b", "\"c\"") +
                       program("c", "\"d\"") + program("d", "\"c\", \"b\"")),
              HasSubstr("lab.toml:12:9: the needs form a cycle: c needs d needs c; remove one"));
}

TEST_F(CheckCrateTest, NamesOfCarriersInOptionsAreThoseOfTheCrate) {
  const auto crate = read(kCarrier + kDac);
  ConfigErrors errors;

  checkCarrierNames(crate, {{"", "model"}, {"ipac", "model"}, {"ipca", "tpci200"}}, errors);

  ASSERT_EQ(errors.lines().size(), 1U);
  EXPECT_THAT(errors.lines()[0], testing::StartsWith("--carrier ipca=tpci200: "));
  EXPECT_THAT(errors.lines()[0], HasSubstr("did you mean \"ipac\"?"));
}

TEST_F(CheckCrateTest, ModulesAreOnCarriersOfTheCrate) {
  EXPECT_THAT(errorsOf(kDac), HasSubstr("carrier \"ipac\" is not in [carriers]; write [carriers]"));
  EXPECT_THAT(errorsOf("[carriers]\nipca = \"model\"\n" + kDac),
              HasSubstr("did you mean \"ipca\"?"));
}

TEST_F(CheckCrateTest, OneProcessDrivesAModule) {
  EXPECT_EQ(errorsOf(kCarrier + kDac), "");
  EXPECT_THAT(errorsOf(kCarrier + kDac +
                       "[[server]]\nprogram = \"ip440\"\nmodule = \"in\"\n"
                       "carrier = \"ipac\"\nsite = \"IP_a\"\n"),
              HasSubstr("the module at IP_a of carrier \"ipac\" is also driven by the process "
                        "\"dac\""));
}

TEST_F(CheckCrateTest, APidServerMayUseADacBesideItsServer) {
  EXPECT_EQ(errorsOf(kCarrier + kDac +
                     "[[server]]\nprogram = \"ip330\"\nmodule = \"adc\"\n"
                     "carrier = \"ipac\"\nsite = \"IP_b\"\n"
                     "pid = \"p,0,dac,1\"\ndac = \"dac,ipac,IP_a\"\n"),
            "");
}

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
