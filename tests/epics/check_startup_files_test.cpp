// SPDX-License-Identifier: MIT
// scripts/check-startup-files: startup files of sites, with their servers and IOC over models.
#include <sys/wait.h>

#include <gmock/gmock.h>

#include "tests/support/command.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

constexpr const char* kFile = R"(ld < mpfLib
routerInit
ipacAddCarrier(&vipc616_01, "0x3000,0xa0000000")
initIpacCarrier("ipac", 0)
initDAC128V("DAC", "ipac", "IP_c", 20)
dbLoadRecords("dac.db", "P=lab:")
dbLoadRecords("none.db", "P=lab:")
iocInit
)";

EndedCommand checkStartupFiles(const TemporaryFolder& folder) {
  const auto programs = std::filesystem::path(MPF_TEST_IOC).parent_path().string();
  return runCommand(MPF_TEST_CHECK_STARTUP_FILES " --programs " + programs + " " +
                    folder.path().string() + " 2>&1");
}

TEST(CheckStartupFiles, CountsServersAndRecordsThatConnect) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("st.cmd", kFile));
  static_cast<void>(folder.write("dac.db", R"(
    record(ao, "$(P)out") { field(DTYP, "dac128V") field(OUT, "#C0 S1 @DAC") field(LINR, "LINEAR")
                            field(EGUL, "-10") field(EGUF, "10") }
    record(motor, "$(P)m") { field(DTYP, "OMS VME58") } # in no IOC of ours
    record(calc, "$(P)c") {})"));

  const auto result = checkStartupFiles(folder);

  EXPECT_EQ(WEXITSTATUS(result.status), 0) << result.output;
  // commands, skipped, servers, ready, records, of MPF, connected
  EXPECT_THAT(result.output, testing::ContainsRegex("st.cmd +8 +2 +1 +1 +2 +1 +1\n"));
  EXPECT_THAT(result.output, HasSubstr("skipped: 1 ld, 1 dbLoadRecords"));
}

TEST(CheckStartupFiles, FailsWhenAFileHasAnError) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("st.cmd", "initDAC128V(\"DAC\", carrier, \"IP_c\", 20)\n"));

  const auto result = checkStartupFiles(folder);

  EXPECT_EQ(WEXITSTATUS(result.status), 1);
  EXPECT_THAT(result.output,
              HasSubstr("st.cmd:1:20: error: initDAC128V: undefined symbol carrier"));
}

}  // namespace
}  // namespace mpf::test
