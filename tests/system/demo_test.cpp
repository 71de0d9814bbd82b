// SPDX-License-Identifier: MIT
// The parts of `make demo` after the first: models that are wired to each other, their servers, the
// voltmeter, and the client that draws their values; and the IOC.
#include <filesystem>
#include <gmock/gmock.h>
#include <string>

#include "tests/support/command.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/terminal.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// Runs the demo without a terminal, with waits that only the watchdog limits.
EndedCommand runDemo(const std::string& build) {
  return runCommand(MPF_TEST_DEMO " " + build + " --seconds 0.1 --patience 1000 </dev/null 2>&1");
}

class Demo : public testing::Test {
 protected:
  // Uses the programs of the build, except that the server of the ADC is this script.
  [[nodiscard]] std::string buildWithAdc(const std::string& script) const {
    const auto programs = folder_.file("bin");
    std::filesystem::create_directory(programs);
    for (const auto& program : std::filesystem::directory_iterator(MPF_TEST_BUILD "/bin"))
      std::filesystem::create_symlink(program, programs + "/" + program.path().filename().string());
    const auto server = programs + "/mpf-ip330-server";
    std::filesystem::remove(server);
    folder_.write("bin/mpf-ip330-server", "#!/bin/bash\n" + script);
    std::filesystem::permissions(server, std::filesystem::perms::owner_all);
    return folder_.path();
  }

  Watchdog watchdog_{"demo test"};
  TemporaryFolder folder_;
};

TEST_F(Demo, PrintsValuesWithoutATerminal) {
  const auto demo = runDemo(MPF_TEST_BUILD);

  EXPECT_EQ(demo.status, 0) << demo.output;
  EXPECT_THAT(demo.output, AllOf(HasSubstr("$ mpf-ip330-server adc ipac IP_b"),
                                 HasSubstr("VOLTMETER"), HasSubstr("  voltmeter "),
                                 HasSubstr("the ADC measured the output of the DAC in"),
                                 HasSubstr("dioOut"), HasSubstr("value=\"HP3458A\\r\\n\"")));
}

TEST_F(Demo, PrintsTheOutputOfAServerThatDoesNotStart) {
  const auto demo = runDemo(buildWithAdc("echo this host has no analog inputs >&2; exit 3\n"));

  EXPECT_NE(demo.status, 0);
  EXPECT_THAT(demo.output, HasSubstr("this host has no analog inputs"));
}

TEST_F(Demo, FailsWhenAWireCarriesNothing) {
  const auto demo = runDemo(
      buildWithAdc("exec " MPF_TEST_BUILD "/bin/mpf-ip330-server \"${@/0=wire:dac.0/0=dc:0}\"\n"));

  EXPECT_NE(demo.status, 0) << demo.output;
  EXPECT_THAT(demo.output, HasSubstr("the ADC measured the output of the DAC in"));
}

TEST_F(Demo, DrawsOnATerminalUntilQ) {
  Terminal demo({MPF_TEST_DEMO, MPF_TEST_BUILD}, 30, 100);
  ASSERT_TRUE(demo.waitFor(" changes"));
  ASSERT_TRUE(demo.waitUntilGone("wired to them: 0 changes"));
  EXPECT_TRUE(demo.waitFor("●"));

  demo.type("q");

  EXPECT_EQ(demo.wait(), 0);
  EXPECT_TRUE(demo.isRestored());
}

// Also before all parts have answered: the voltmeter needs more than a millisecond.
TEST_F(Demo, ExitsOnQAndCtrlC) {
  constexpr auto* kQuit = "q";
  constexpr auto* kInterrupt = "\x03";
  for (const auto* const key : {kQuit, kInterrupt}) {
    Terminal demo({MPF_TEST_DEMO, MPF_TEST_BUILD, "--patience", "0.001"}, 30, 100);
    ASSERT_TRUE(demo.waitFor("q quit"));

    demo.type(key);

    EXPECT_EQ(demo.wait(), 0);
    EXPECT_TRUE(demo.isRestored());
  }
}

TEST_F(Demo, AnIocShowsADeadServerToItsClients) {
  const auto demo = runCommand(MPF_TEST_DEMO_IOC " " MPF_TEST_BUILD " </dev/null 2>&1");
  if (demo.output.starts_with("left out")) GTEST_SKIP() << demo.output;

  EXPECT_EQ(demo.status, 0) << demo.output;
  EXPECT_THAT(demo.output, AllOf(HasSubstr("   lab:volts 2.50 V, severity 0\n"),
                                 HasSubstr(" 2.495117188\n"),  // lab:meter
                                 HasSubstr("   lab:volts 2.50 V, severity 3\n"),
                                 HasSubstr("'server is not running'"),
                                 HasSubstr("   lab:volts -1.25 V, severity 0\n")));
}

}  // namespace
}  // namespace mpf::test
