// SPDX-License-Identifier: MIT
// The manual's example as a whole: its device support in an IOC, and its server of an IP330 as a
// process with a model of the board.
#include <cstdlib>
#include <registryDeviceSupport.h>

#include "tests/epics/epics_fixture.h"
#include "tests/support/program.h"

extern "C" dset* pvar_dset_devAiManual;

namespace mpf::test {
namespace {

using ClassicIocTest = EpicsTest;

constexpr const char* kDatabase = R"(
  device(ai, VME_IO, devAiManual, "ip330Scan of the manual")
  record(ai, "v") {
    field(DTYP, "ip330Scan of the manual") field(INP, "#C0 S3 @adc,1") field(SCAN, ".1 second")
    field(LINR, "LINEAR") field(EGUL, "-2.5") field(EGUF, "2.5") field(PREC, "2")
  })";

TEST_F(ClassicIocTest, ARecordReadsTheBoardAndSurvivesARestartOfTheServer) {
  const std::vector<std::string> command{MPF_TEST_CLASSIC_IP330, "adc", "3=dc:1.25"};
  std::optional<Program> server(command);
  registryDeviceSupportAdd("devAiManual", pvar_dset_devAiManual);
  const Ioc ioc(kDatabase);

  Ioc::waitFor("v", "1.25");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
  server.reset();
  Ioc::waitFor("v.STAT", "COMM");
  server.emplace(command);
  Ioc::waitFor("v.SEVR", "NO_ALARM");
  Ioc::waitFor("v", "1.25");
}

}  // namespace
}  // namespace mpf::test
