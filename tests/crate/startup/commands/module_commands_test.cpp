// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using ModuleCommands = StartupScene;

TEST_F(ModuleCommands, ADacIsAProcess) {
  const auto startup = read(kCarrier + "p = initDAC128V(\"DAC\", \"ipac\", \"IP_b\", 20)\n");
  EXPECT_THAT(settingsOf(startup, "DAC"),
              ElementsAre("module=DAC", "carrier=ipac", "site=IP_b", "queuesize=20"));
}

TEST_F(ModuleCommands, DigitalIoTakesAsManyArgumentsAsWereWritten) {
  const auto startup =
      read(kCarrier +
           "initIpUnidig(\"U\", \"ipac\", \"IP_c\", 20)\n"
           "initIpUnidig(\"V\", \"ipac\", \"IP_d\", 20,2000,116,0xff,0xff00,0,10)\n");
  EXPECT_THAT(settingsOf(startup, "U"),
              ElementsAre("module=U", "carrier=ipac", "site=IP_c", "queuesize=20"));
  EXPECT_THAT(settingsOf(startup, "V"),
              ElementsAre("module=V", "carrier=ipac", "site=IP_d", "queuesize=20", "mspoll=2000",
                          "intvec=116", "risingmask=255", "fallingmask=65280", "bimask=0",
                          "maxclients=10"));
}

TEST_F(ModuleCommands, AQueueSizeOf0IsTheDefault) {
  const auto startup = read(kCarrier +
                            "initDAC128V(\"DAC\", \"ipac\", \"IP_b\", 0)\n"
                            "initIpUnidig(\"U\", \"ipac\", \"IP_c\", 0, 50)\n");
  EXPECT_THAT(settingsOf(startup, "DAC"), testing::Contains("queuesize=20"));
  EXPECT_THAT(settingsOf(startup, "U"), testing::IsSupersetOf({"queuesize=20", "mspoll=50"}));
}

// The server of the crate would not start.
TEST_F(ModuleCommands, RefuseWhatTheServerRefuses) {
  const std::string unidig = kCarrier + "initIpUnidig(\"U\", \"ipac\", \"IP_c\", ";
  EXPECT_THAT(errorOf(unidig + "20, 3600001)\n"), HasSubstr("mspoll is 3600001; it must be"));
  EXPECT_THAT(errorOf(unidig + "20, 100, 300)\n"),
              HasSubstr("3:44: error: initIpUnidig: intvec is 300; it must be between 0 and 255"));
  EXPECT_THAT(errorOf(unidig + "16385)\n"), HasSubstr("queueSize is 16385; it must be between 0"));
}

TEST_F(ModuleCommands, RefuseAModuleTwice) {
  EXPECT_THAT(errorOf(kCarrier + "initDAC128V(\"D\", \"ipac\", \"IP_b\", 20)\n"
                                 "initDAC128V(\"D\", \"ipac\", \"IP_c\", 20)\n"),
              HasSubstr("4:13: error: initDAC128V: the module \"D\" exists already"));
  EXPECT_THAT(errorOf(kCarrier + "initDAC128V(\"D\", \"ipac\", \"IP_b\", 20)\n"
                                 "initIpUnidig(\"U\", \"ipac\", \"IP_b\", 20)\n"),
              HasSubstr("4:1: the module at IP_b of carrier \"ipac\" is also driven by"));
}

}  // namespace
}  // namespace mpf::test
