// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Ip330Commands : public StartupScene {
 protected:
  // The settings after those of initIp330(), of a file with the module `p`.
  std::vector<std::string> settingsAfter(const std::string& commands) {
    const auto all = settingsOf(read(kModule + commands), "adc");
    return {all.begin() + 9, all.end()};
  }
  static inline const std::string kModule =
      kCarrier + "p = initIp330(\"adc\", \"ipac\", \"IP_a\", \"D\", \"-5to5\", 0, 15, 10, 120)\n";
};

TEST_F(Ip330Commands, TheModuleIsAProcess) {
  EXPECT_THAT(settingsOf(read(kModule), "adc"),
              ElementsAre("module=adc", "carrier=ipac", "site=IP_a", "type=D", "range=-5to5",
                          "first=0", "last=15", "maxclients=10", "vector=120"));
}

TEST_F(Ip330Commands, TheLastConfigurationCounts) {
  EXPECT_THAT(
      settingsAfter("configIp330(p, 3,\"Input\",500,0)\nconfigIp330(p,2,\"Output\",0,-1)\n"),
      ElementsAre("scan-mode=2", "trigger=Output", "us-per-scan=500",
                  "seconds-between-calibrate=-1"));
}

TEST_F(Ip330Commands, ServersOfTheModuleAreItsSettings) {
  EXPECT_THAT(settingsAfter("initIp330Scan(p, \"six\", 0, 15, 100, 20)\n"
                            "initIp330Scan(p, \"five\", 0, 7, 30)\n"
                            "initIp330Config(p, \"config\", 0)\n"
                            "initIp330Sweep(p, \"sweep\", 0, 3, 2048, 100)\n"),
              ElementsAre("scan=six,0,15,100,20", "scan=five,0,7,0,30", "config=config",
                          "sweep=sweep,0,3,2048,100"));
}

TEST_F(Ip330Commands, AFeedbackOpensItsDacOnce) {
  EXPECT_THAT(settingsAfter("dac = initDAC128V(\"DAC\", \"ipac\", \"IP_b\", 20)\n"
                            "initIp330PID(\"one\", p, 0, dac, 1, 20)\n"
                            "initIp330PID(\"two\", p, 1, dac, 2, 20)\n"),
              ElementsAre("dac=DAC,ipac,IP_b", "pid=one,0,DAC,1,20", "pid=two,1,DAC,2,20"));
}

TEST_F(Ip330Commands, ReleaseTwoNamesTheModules) {
  EXPECT_THAT(settingsAfter("initDAC128V(\"DAC\", 0, 1, 20)\n"
                            "initIp330Scan(\"adc\", \"scan\", 0, 15, 20)\n"
                            "initIp330PID(\"pid\", \"adc\", 0, \"DAC\", 1, 20)\n"),
              ElementsAre("scan=scan,0,15,0,20", "dac=DAC,ipac,IP_b", "pid=pid,0,DAC,1,20"));
}

TEST_F(Ip330Commands, TheFormOfReleaseOneCreatesTheModule) {
  const auto startup =
      read(kCarrier + "initIp330Scan(\"adc\", \"ipac\", \"IP_a\", \"S\", \"0to10\", 120, 20)\n");
  EXPECT_THAT(settingsOf(startup, "adc"),
              ElementsAre("module=adc", "carrier=ipac", "site=IP_a", "type=S", "range=0to10",
                          "first=0", "last=31", "maxclients=10", "vector=120"));
}

TEST_F(Ip330Commands, TheFormOfReleaseOneIsCheckedAsTheLaterOne) {
  EXPECT_THAT(
      errorOf(kCarrier + "initIp330Scan(\"adc\", \"ipac\", \"IP_a\", \"S\", \"0to11\", 120, 20)\n"),
      HasSubstr("range \"0to11\"; write -5to5"));
  const std::string again =
      "initIp330Scan(\"adc\", \"ipac\", \"IP_a\", \"S\", \"0to10\", 120, 20)\n";
  EXPECT_THAT(errorOf(kCarrier + again + again), HasSubstr("the module \"adc\" exists already"));
}

TEST_F(Ip330Commands, RefuseWhatIsNoModule) {
  EXPECT_THAT(errorOf("initIp330Scan(pIp330, \"scan\", 0, 15, 100, 20)\n"),
              HasSubstr("1:15: error: initIp330Scan: undefined symbol pIp330 is not a module of "
                        "initIp330, which must come before this line"));
  EXPECT_THAT(errorOf(kModule + "initIp330PID(\"pid\", p, 0, p, 1, 20)\n"),
              HasSubstr("4:27: error: initIp330PID: "));
  EXPECT_THAT(errorOf(kCarrier + "p = initIp330(\"adc\", \"ipac\", \"IP_a\", \"D\", \"5\")\n"),
              HasSubstr("range \"5\"; write -5to5"));
}

// The server of the crate would not start.
TEST_F(Ip330Commands, RefuseWhatTheServerRefuses) {
  const auto board = [](const std::string& arguments) {
    return kCarrier + "p = initIp330(\"adc\", \"ipac\", \"IP_a\", " + arguments + ")\n";
  };
  EXPECT_THAT(errorOf(board(R"("D", "-5to5", 0, 31, 5, 120)")),
              HasSubstr("3:52: error: initIp330: channels 0 to 31: use 0 to 15"));
  EXPECT_THAT(errorOf(kModule + "configIp330(p, 3, \"Input\", 100, 60)\n"),
              HasSubstr("4:28: error: configIp330: 100 us per scan of 16 channels in mode "
                        "burstContinuous: use "));
  EXPECT_THAT(errorOf(kModule + "initIp330Scan(p, \"s\", 20, 3, 100)\n"),
              HasSubstr("4:23: error: initIp330Scan: channels 20 to 3 are not available: the board "
                        "scans 0 to 15"));
  EXPECT_THAT(errorOf(kModule + "initIp330Sweep(p, \"s\", 0, 16, 100, 20)\n"),
              HasSubstr("channels 0 to 16 are not available"));
  EXPECT_THAT(errorOf(board(R"("D", "-5to5", 0, 15, 1, 120)") +
                      "initIp330Scan(p, \"s\", 0, 3, 100)\ninitIp330Scan(p, \"t\", 0, 3, 100)\n"),
              HasSubstr("5:15: error: initIp330Scan: the module \"adc\" has 1 servers"));
}

// The error of a module is not repeated for each of its servers.
TEST_F(Ip330Commands, TheServersOfAModuleThatFailedAreNoFurtherErrors) {
  try {
    static_cast<void>(
        read("p = initIp330(\"adc\", \"ipac\", \"IP_a\")\n"
             "initIp330Scan(p, \"scan\", 0, 15, 100, 20)\n"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("initIp330Scan")));
  }
}

TEST_F(Ip330Commands, ParametersOfAFeedbackAreThoseOfItsClients) {
  EXPECT_THAT(remarksOf(read(kModule + "configIp330PID(p, 1, 2, 3, 4, 1, 0, 4095)\n")),
              ElementsAre(HasSubstr("configIp330PID is skipped: clients set the parameters")));
}

}  // namespace
}  // namespace mpf::test
