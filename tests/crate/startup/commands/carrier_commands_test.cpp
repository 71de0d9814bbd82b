// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class CarrierCommands : public StartupScene {
 protected:
  // The carriers as "name=kind", of a file whose carriers keep their boards.
  std::string carriersOf(const std::string& text) {
    options_.carriers.clear();
    std::string all;
    for (const auto& carrier : read(text + kServer).crate.carriers)
      all += carrier.name + "=" + carrier.kind + " ";
    return all;
  }
  static constexpr const char* kServer =
      "\ninitTtyPort(\"p\", \"/dev/null\", 9600)\ninitSerialServer(\"s\", \"p\")\n";
};

TEST_F(CarrierCommands, ANameBelongsToTheCarrierWithItsNumber) {
  EXPECT_EQ(carriersOf("ipacAddCarrier(&vipc616_01, \"0x3000,0xa0000000\")\n"
                       "ipacAddCarrier(&ipmv162, \"A:l=3,3 m=0xe0000000,64\")\n"
                       "name = \"one\"\ninitIpacCarrier(name, 1)\ninitIpacCarrier \"zero\", 0\n"),
            "one=ipmv162:A:l=3,3 m=0xe0000000,64 zero=vipc616_01:0x3000,0xa0000000 ");
}

TEST_F(CarrierCommands, NullReservesANumber) {
  EXPECT_EQ(carriersOf("ipacAddCarrier(NULL, \"\")\nipacAddCarrier(&vipc616_01, \"0x3000\")\n"
                       "initIpacCarrier(\"ipac\", 1)\n"),
            "ipac=vipc616_01:0x3000 ");
  EXPECT_THAT(errorOf("ipacAddCarrier(0, \"\")\ninitIpacCarrier(\"ipac\", 0)\n"),
              HasSubstr("2:25: error: initIpacCarrier: there is no carrier 0; 1 were added"));
}

TEST_F(CarrierCommands, TheCommandsOfLaterReleasesReturnTheNumber) {
  EXPECT_EQ(carriersOf("first = ipacAddVIPC616_01(\"0x3000,0xa0000000\")\n"
                       "second = ipacAddTVME200(\"6010D0\")\ninitIpacCarrier(\"b\", second)\n"),
            "b=ipacAddTVME200:6010D0 ");
}

TEST_F(CarrierCommands, RefuseWhatIsNoCarrier) {
  EXPECT_THAT(errorOf("ipacAddCarrier(&vipc617, \"\")\n"),
              HasSubstr("1:16: error: ipacAddCarrier: &vipc617 is not a type of carrier"));
  EXPECT_THAT(errorOf("ipacAddCarrier(&vipc616_01, \"rubbish\")\n"),
              HasSubstr("1:29: error: ipacAddCarrier: "));
  EXPECT_THAT(errorOf("initIpacCarrier(\"ipac\", 0)\n"), HasSubstr("there is no carrier 0"));
  EXPECT_THAT(errorOf(kCarrier + "ipacAddCarrier(&vipc616_01, \"0x3400\")\n"
                                 "initIpacCarrier(\"ipac\", 1)\n"),
              HasSubstr("4:17: error: initIpacCarrier: the name \"ipac\" belongs to another"));
}

TEST_F(CarrierCommands, ModulesAreOnKnownCarriersAndSites) {
  EXPECT_THAT(errorOf("initDAC128V(\"DAC\", \"ipac\", \"IP_a\", 20)\n"),
              HasSubstr("1:20: error: initDAC128V: there is no carrier \"ipac\"; name it"));
  EXPECT_THAT(errorOf(kCarrier + "initDAC128V(\"DAC\", \"ipac\", \"a\", 20)\n"),
              HasSubstr("3:28: error: initDAC128V: site \"a\"; write IP_a"));
  EXPECT_THAT(errorOf(kCarrier + "initDAC128V(\"DAC\", carrier2, \"IP_a\", 20)\n"),
              HasSubstr("3:20: error: initDAC128V: undefined symbol carrier2"));
  EXPECT_THAT(errorOf("initDAC128V(\"DAC\", 0, 2, 20)\n"),
              HasSubstr("1:20: error: initDAC128V: there is no carrier 0"));
}

TEST_F(CarrierCommands, NumbersOfReleaseTwoAreCarriersAndSites) {
  const auto startup =
      read("ipacAddVIPC616_01(\"0x3000,0xa0000000\")\ninitDAC128V(\"DAC\", 0, 2, 20)\n");

  EXPECT_THAT(settingsOf(startup, "DAC"),
              testing::ElementsAre("module=DAC", "carrier=carrier0", "site=IP_c", "queuesize=20"));
  EXPECT_EQ(startup.crate.carriers.at(0).kind, "model");
}

TEST_F(CarrierCommands, ABoardOutOfReachIsAnErrorUnlessItIsReplaced) {
  options_.carriers.clear();
  const auto file = kCarrier + "initDAC128V(\"DAC\", \"ipac\", \"IP_a\", 20)\n";
  EXPECT_THAT(errorOf(file), HasSubstr("1:1: carrier \"ipac\" is a vipc616_01, which this host "
                                       "cannot reach; use --carrier model"));

  options_.carriers = {{"ipac", "tpci200"}};
  EXPECT_EQ(read(file).crate.carriers.at(0).kind, "tpci200");
  options_.carriers = {{"ipac", "tpci200"}, {"", "model"}};
  EXPECT_EQ(read(file).crate.carriers.at(0).kind, "tpci200");
}

}  // namespace
}  // namespace mpf::test
