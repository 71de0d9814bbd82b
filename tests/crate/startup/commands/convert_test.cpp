// SPDX-License-Identifier: MIT
// mpf convert, and mpf run with a startup file.
#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <sstream>

#include "crate/config/read_crate.h"
#include "tests/crate/startup/commands/startup_scene.h"
#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class ConvertTest : public testing::Test {
 protected:
  ConvertTest() {
    ::setenv("MPF_CRATES", folder_.file("crates").c_str(), 1);
    ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);
    static_cast<void>(folder_.write(
        "st.cmd", kCarrier + "initDAC128V(\"DAC\", \"ipac\", \"IP_a\", 20)\nseq &x\n"));
  }
  EndedCommand mpf(const std::string& arguments) {
    return runCommand(fmt::format("cd {} && {} {} 2>&1", folder_.path().string(), MPF, arguments));
  }

  const Watchdog watchdog_{"convert test"};
  TemporaryFolder folder_;
  const TestBackplane backplane_;
};

TEST_F(ConvertTest, WritesACrateFileAndListsWhatIsSkipped) {
  const auto result = mpf("convert st.cmd --name lab");

  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("lab.toml is written"));
  EXPECT_THAT(result.output, HasSubstr("st.cmd:4:1: warning: seq is skipped"));
  const auto crate = crate::readCrate(folder_.file("lab.toml"));
  EXPECT_EQ(crate.name, "lab");
  EXPECT_EQ(crate.carriers.at(0).kind, "model");
  EXPECT_EQ(crate.processes.at(0).name, "DAC");
}

TEST_F(ConvertTest, OverwritesNothing) {
  EXPECT_EQ(mpf("convert st.cmd --name lab").status, 0);
  const auto again = mpf("convert st.cmd --name lab");
  EXPECT_NE(again.status, 0);
  EXPECT_THAT(again.output, HasSubstr("lab.toml exists; choose another"));
}

TEST_F(ConvertTest, WritesBothFilesOrNone) {
  static_cast<void>(folder_.write("ioc.cmd", "iocInit\n"));
  static_cast<void>(folder_.write("lab.toml", ""));

  EXPECT_EQ(WEXITSTATUS(mpf("convert ioc.cmd --name lab").status), 1);

  EXPECT_FALSE(std::filesystem::exists(folder_.file("lab-ioc.cmd")));
}

TEST_F(ConvertTest, RefusesACrateFile) {
  static_cast<void>(folder_.write("lab.toml", "[[server]]\nprogram = \"int32\"\n"));
  const auto result = mpf("convert lab.toml");
  EXPECT_EQ(WEXITSTATUS(result.status), 2);
  EXPECT_THAT(result.output,
              testing::StartsWith("mpf convert: lab.toml is a crate file; use a startup file"));
}

TEST_F(ConvertTest, RunChecksAStartupFile) {
  EXPECT_THAT(mpf("run --check --carrier model st.cmd").output,
              HasSubstr("st.cmd: 1 process, no error"));
  const auto failed = mpf("run st.cmd");
  EXPECT_EQ(WEXITSTATUS(failed.status), 2);
  EXPECT_THAT(failed.output, HasSubstr("use --carrier model for models"));
  EXPECT_THAT(mpf("run --dry-run --carrier model st.cmd").output,
              HasSubstr("mpf-dac128v-server DAC ipac IP_a 20 --carrier=ipac=model"));
}

TEST_F(ConvertTest, RunStartsTheServersOfAStartupFile) {
  Program supervisor({MPF, "run", "--carrier", "model", "--name", "lab", folder_.file("st.cmd")});

  while (mpf("call DAC int32 address=2 value=1234").output.find("status=0") == std::string::npos)
    ASSERT_FALSE(supervisor.hasEnded()) << supervisor.errors();

  EXPECT_EQ(supervisor.end(SIGTERM), 0);
}

}  // namespace
}  // namespace mpf::test
