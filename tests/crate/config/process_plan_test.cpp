// SPDX-License-Identifier: MIT
// planProcesses(): the command line, environment and limits of each process.
#include "crate/config/process_plan.h"

#include <cstdlib>

#include "base/program_beside.h"
#include "tests/crate/config/crate_text.h"

// NOLINTBEGIN(modernize-raw-string-literal): a test case is one line
namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

class ProcessPlanTest : public CrateTextTest {
 protected:
  std::vector<ProcessPlan> plan(const std::string& text) {
    return planProcesses(read(text), "/run");
  }
  // The command line without the folder of the program.
  std::string lineOf(const std::string& text) {
    auto only = plan(text).at(0);
    only.environment.clear();
    only.command[0] = only.command[0].substr(only.command[0].rfind('/') + 1);
    return shellText(only);
  }
};

TEST_F(ProcessPlanTest, PositionalArgumentsComeFirst) {
  EXPECT_EQ(lineOf("[carriers]\nipac = \"tpci200:0\"\nother = \"model\"\n[[server]]\n"
                   "program = \"dac128v\"\nranges = \"0to10\"\nwait = true\nqueuesize = 20\n"
                   "site = \"IP_d\"\ncarrier = \"ipac\"\nmodule = \"dac\"\n"),
            "mpf-dac128v-server dac ipac IP_d 20 --ranges=0to10 --wait --carrier=ipac=tpci200:0");
}

TEST_F(ProcessPlanTest, ModelsShareTheirWires) {
  EXPECT_THAT(lineOf("[carriers]\nipac = \"model\"\n[[server]]\nprogram = \"ip440\"\n"
                     "module = \"in\"\ncarrier = \"ipac\"\nsite = \"IP_a\"\nwait = false\n"),
              EndsWith(" --carrier=ipac=model --wires=/run/wires"));
}

TEST_F(ProcessPlanTest, ASerialServerHasOneLineOrSeveral) {
  EXPECT_EQ(lineOf("[[server]]\nprogram = \"serial\"\nserver = \"dmm\"\nport = \"/dev/ttyS0\"\n"
                   "baud = 19200\n"),
            "mpf-serial-server dmm /dev/ttyS0 --baud=19200");
  EXPECT_EQ(lineOf("[[server]]\nprogram = \"serial\"\nserver = [\"a,/dev/a\", \"b,/dev/b\"]\n"),
            "mpf-serial-server --server=a,/dev/a --server=b,/dev/b");
}

TEST_F(ProcessPlanTest, DefaultsOfTheCrateReachItsServers) {
  const std::string crate = "mode = \"0660\"\nlog-level = \"debug\"\n";

  EXPECT_EQ(lineOf(crate + "[[server]]\nprogram = \"int32\"\nlog-level = \"off\"\n"),
            "mpf-int32-server --log-level=off --mode=0660");
  EXPECT_EQ(lineOf(crate + "[[router]]\nfile = \"r.toml\"\n"),
            "mpf-router r.toml --mode=0660 --log-level=debug");
  EXPECT_EQ(lineOf(crate + "[[ioc]]\ndatabase = [\"a.db\"]\nmacros = \"P=a:\"\n"),
            "mpf-ioc --database=a.db --macros=P=a: --no-shell");
}

TEST_F(ProcessPlanTest, OnlyTheNameOfAProgramOfMpfIsThatOfAProgramBesideThisOne) {
  const auto programOf = [this](const std::string& name) {
    return plan("[[program]]\nname = \"a\"\ncommand = [\"" + name + "\"]\n").at(0).command.at(0);
  };

  EXPECT_EQ(programOf("mpf-int32-server"), programBeside("mpf-int32-server"));
  EXPECT_EQ(programOf("mpf-of-a-site"), "mpf-of-a-site");  // in PATH
  EXPECT_EQ(programOf("mpf/run.sh"), "mpf/run.sh");  // in the working folder
}

TEST_F(ProcessPlanTest, TheEnvironmentNamesTheBackplane) {
  ::setenv("MPF_BACKPLANE", "inherited", 1);
  const std::string server = "[[server]]\nprogram = \"int32\"\n";
  const auto inherited = plan(server).at(0);
  const auto own = plan("backplane = \"own\"\nlocation = 2\n[environment]\nA = \"a\"\n" + server +
                        "location = 5\nenvironment = {A = \"b\"}\n")
                       .at(0);

  EXPECT_EQ(inherited.environment.at("MPF_BACKPLANE"), "inherited");
  EXPECT_EQ(inherited.environment.at("MPF_LOCATION"), "0");
  EXPECT_EQ(own.backplane, "own");
  EXPECT_EQ(own.location, 5);
  EXPECT_EQ(own.environment.at("MPF_BACKPLANE"), "own");
  EXPECT_EQ(own.environment.at("MPF_LOCATION"), "5");
  EXPECT_EQ(own.environment.at("A"), "b");
  EXPECT_EQ(own.workingFolder, folder_.path().string() + "/");
}

TEST_F(ProcessPlanTest, LimitsAreThoseOfTheProcessOrOfTheCrate) {
  const auto plans = plan(
      "[supervision]\nstall-limit = \"3s\"\nmax-restarts = 5\n[[server]]\nprogram = \"int32\"\n"
      "stall-limit = \"off\"\nbusy-limit = \"7s\"\n");

  EXPECT_EQ(plans[0].stallLimit, 0ms);
  EXPECT_EQ(plans[0].busyLimit, 7s);
  EXPECT_EQ(plans[0].maxRestarts, 5);
  EXPECT_EQ(plans[0].startTime, kStartTime);
}

TEST_F(ProcessPlanTest, AProcessComesAfterThoseThatItNeeds) {
  const auto plans = plan(
      "[[program]]\nname = \"a\"\ncommand = \"a\"\nneeds = [\"b\"]\n"
      "[[program]]\nname = \"b\"\ncommand = \"b\"\nneeds = [\"c\"]\n"
      "[[program]]\nname = \"c\"\ncommand = \"c\"\n");

  ASSERT_EQ(plans.size(), 3U);
  EXPECT_EQ(plans[0].name + plans[1].name + plans[2].name, "cba");
}

// Otherwise a reload would not restart the IOC.
TEST_F(ProcessPlanTest, AChangedFileOfAnIocChangesItsPlan) {
  const std::string crate = "[[ioc]]\nstartup = \"st.cmd\"\ndatabase = [\"a.db\", \"none.db\"]\n";
  folder_.write("a.db", "record(ai, \"a\") {}");
  folder_.write("st.cmd", "iocInit");
  const auto before = plan(crate);

  EXPECT_EQ(before[0].inputs.size(), 2U);
  folder_.write("a.db", "record(ai, \"a\") {}");
  EXPECT_EQ(plan(crate), before) << "the same content";
  folder_.write("a.db", "record(ai, \"b\") {}");
  EXPECT_NE(plan(crate), before);
}

TEST(ShellText, QuotesWhatAShellWouldChange) {
  ProcessPlan plan;
  plan.environment = {{"A", "x y"}};
  plan.command = {"mpf-x", "a[0]", "it's", "", "--b=c,d"};

  EXPECT_EQ(shellText(plan), R"(A='x y' mpf-x 'a[0]' 'it'\''s' '' --b=c,d)");
}

TEST(ContextText, HasWhatTheCommandLineDoesNotSay) {
  ProcessPlan plan;
  plan.user = "mpf";
  plan.workingFolder = "/a b";
  plan.inputs = {{"a.db", 7}};

  EXPECT_EQ(contextText(plan), "user=mpf folder='/a b' a.db=7");
}

TEST(ShellText, APlanWithoutACommandHasNoText) { EXPECT_EQ(shellText(ProcessPlan()), ""); }

}  // namespace
}  // namespace mpf::crate::test
// NOLINTEND(modernize-raw-string-literal)
