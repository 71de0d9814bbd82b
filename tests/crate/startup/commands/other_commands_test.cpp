// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using OtherCommands = StartupScene;

TEST_F(OtherCommands, AreSkippedWithTheReason) {
  const auto startup = read(kCarrier +
                            "ld < mpfLib\n"
                            "AIMConfig(\"AIM1/1\", 0x98b, 1, 2048, 1, 1, \"dc0\", 100)\n"
                            "seq &Keithley, \"P=x:\"\nmotorSetup(1)\niocInit\n");

  EXPECT_THAT(
      remarksOf(startup),
      ElementsAre("ld is skipped: it has no meaning here",
                  HasSubstr("AIMConfig is skipped: it starts a server of another package"),
                  HasSubstr("seq is skipped"), "unknown command motorSetup; it is skipped"));
  EXPECT_EQ(startup.diagnostics.skipped(), 4);
}

}  // namespace
}  // namespace mpf::test
