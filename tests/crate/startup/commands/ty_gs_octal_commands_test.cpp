// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using TyGsOctalCommands = StartupScene;

const std::string kModule =
    "ipacAddVIPC616_01(\"0x3000,0xa0000000\")\ntyGSOctalDrv 1\n"
    "uart = tyGSOctalModuleInit(\"GSIP_OCTAL232\", 0x80, 0, 0)\n";

TEST_F(TyGsOctalCommands, ADeviceIsAPortUnderBothNames) {
  const auto startup = read(kModule +
                            "tty = tyGSOctalDevCreate(\"/tyGS/0/3\", uart, 3, 1000, 1000)\n"
                            "initTtyVxPort(\"UART[3]\", \"/tyGS/0/3\", 19200, 1000)\n"
                            "initSerialServer(\"s\", \"UART[3]\", 1000, 20, \"\\r\")\n"
                            "tyGSOctalConfig(tty, 9600, 'E', 2, 7, 'N')\n");

  EXPECT_THAT(settingsOf(startup, "octal-carrier0-IP_a"),
              ElementsAre("octal-uart=octal-carrier0-IP_a,carrier0,IP_a,8,128",
                          "octal-port=/tyGS/0/3,octal-carrier0-IP_a,3,9600,E,2,7,N",
                          "server=s,/tyGS/0/3,1000,20,\\r,1"));
}

TEST_F(TyGsOctalCommands, OneCommandDoesAll) {
  const auto startup =
      read(kModule + "tyGSMPFInit(\"srv\", uart, 2, 9600, 'N', 1, 8, 'N', \"\")\n");

  EXPECT_THAT(settingsOf(startup, "octal-carrier0-IP_a"),
              ElementsAre(testing::_, "octal-port=srv,octal-carrier0-IP_a,2,9600,N,1,8,N",
                          "server=srv,srv,1000,50,none,1"));
}

TEST_F(TyGsOctalCommands, AreCheckedAsThoseOfReleaseOne) {
  const std::string device = kModule + "tyGSOctalDevCreate(\"d\", uart, 3, 1000, 1000)\n";
  EXPECT_THAT(errorOf(kModule + "tyGSMPFInit(\"s\", uart, 2, 9600, 'N', 1, 8, 'N', \"abc\")\n"),
              HasSubstr("tyGSMPFInit: eom has 3 bytes"));
  EXPECT_THAT(errorOf(kModule + "tyGSMPFInit(\"s\", uart, 2, 9601, 'N', 1, 8, 'N', \"\")\n"),
              HasSubstr("tyGSMPFInit: baud 9601: the chip supports"));
  EXPECT_THAT(errorOf(device + "initTtyVxPort(\"p\", \"d\", 9601, 1000)\n"),
              HasSubstr("initTtyVxPort: baud 9601: the chip supports"));
  EXPECT_THAT(errorOf(device + "tyGSOctalDevCreate(\"e\", uart, 3, 1000, 1000)\n"),
              HasSubstr("is the port \"d\" already"));
  EXPECT_THAT(errorOf(device + "initTtyVxPort(\"p\", \"d\", 9600, 1000)\n"
                               "initSerialServer(\"s\", \"p\")\ninitSerialServer(\"t\", \"d\")\n"),
              HasSubstr("the port \"d\" has the server \"s\" already"));
}

TEST_F(TyGsOctalCommands, RefuseWhatDoesNotExistYet) {
  EXPECT_THAT(errorOf("tyGSOctalDevCreate(\"d\", uart, 0, 1000, 1000)\n"),
              HasSubstr("1:25: error: tyGSOctalDevCreate: undefined symbol uart is not the result "
                        "of tyGSOctalModuleInit"));
  EXPECT_THAT(errorOf("tyGSOctalConfig(tty, 9600, 'N', 1, 8, 'N')\n"),
              HasSubstr("is not the result of tyGSOctalDevCreate"));
  EXPECT_THAT(errorOf("initTtyVxPort(\"p\", \"/tyGS/0/0\", 9600, 1000)\n"),
              HasSubstr("1:20: error: initTtyVxPort: there is no device \"/tyGS/0/0\""));
  EXPECT_THAT(errorOf(kModule + "u = tyGSOctalModuleInit(\"GSIP_OCTAL232\", 0x81, 0, 0)\n"),
              HasSubstr("the module at IP_a of carrier \"carrier0\" exists already"));
}

}  // namespace
}  // namespace mpf::test
