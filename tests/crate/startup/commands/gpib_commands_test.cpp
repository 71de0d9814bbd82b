// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using GpibCommands = StartupScene;

const std::string kGpibModule = kCarrier + "initGpibGsTi9914(\"M\",\"ipac\",\"IP_c\",105)\n";

TEST_F(GpibCommands, AModuleAndItsServerAreAProcess) {
  const auto startup = read(kGpibModule + "initGpibServer(\"GPIB0\",\"M\",4096,1000)\n");

  EXPECT_THAT(settingsOf(startup, "M"),
              ElementsAre("server=GPIB0", "module=M", "ti9914=M,ipac,IP_c,105", "bufsize=4096",
                          "queuesize=1000"));
}

TEST_F(GpibCommands, AModuleWithoutServerHasOneOfItsName) {
  EXPECT_THAT(settingsOf(read(kGpibModule), "M"),
              ElementsAre("server=M", "module=M", "ti9914=M,ipac,IP_c,105"));
}

TEST_F(GpibCommands, LinksAreThoseOfTheIoc) {
  const auto startup = read(kGpibModule + "initGpibServer(\"GPIB0\",\"M\",4096,1000)\n" +
                            "HiDEOSGpibLinkConfig(10,1,\"GPIB1\")\n"
                            "HiDEOSGpibLinkConfig(11,0,\"M\")\niocInit\n");

  EXPECT_THAT(startup.iocText, HasSubstr("HiDEOSGpibLinkConfig(\"10\", \"1\", \"GPIB1\")\n"));
  EXPECT_THAT(startup.iocText, HasSubstr("HiDEOSGpibLinkConfig(\"11\", \"0\", \"GPIB0\")\n"))
      << "the server of the module";
}

TEST_F(GpibCommands, ALinkToAModuleOfTheFileWarnsOfAnotherLocation) {
  const auto at = [&](const char* board) {
    return remarksOf(read(kGpibModule + "HiDEOSGpibLinkConfig(10," + board + ",\"M\")\niocInit\n"));
  };
  EXPECT_THAT(at("0"), testing::IsEmpty());
  EXPECT_THAT(at("1"), ElementsAre(HasSubstr("boardId 1 is ignored, because \"M\" is a module of "
                                             "this file, at location 0")));
}

TEST_F(GpibCommands, ASnifferIsAProgram) {
  const auto startup = read(kGpibModule + "gpibSniff(\"M\",3)\n");

  ASSERT_EQ(startup.crate.processes.size(), 2U);
  EXPECT_THAT(startup.crate.processes.at(1).command, ElementsAre("mpf", "gpib-sniff", "M", "3"));
  EXPECT_THAT(startup.crate.processes.at(1).needs, ElementsAre("M"));
}

TEST_F(GpibCommands, RefuseWhatDoesNotExist) {
  EXPECT_THAT(errorOf(kCarrier + "initGpibServer(\"GPIB0\",\"M\",4096,1000)\n"),
              HasSubstr("initGpibServer: the module \"M\" does not exist at this line"));
  EXPECT_THAT(errorOf(kCarrier + "gpibSniff(\"M\",3)\n"),
              HasSubstr("gpibSniff: the module \"M\" does not exist at this line"));
  EXPECT_THAT(errorOf(kGpibModule + "initGpibGsTi9914(\"M\",\"ipac\",\"IP_d\",105)\n"),
              HasSubstr("the module \"M\" exists already"));
  EXPECT_THAT(
      errorOf(kGpibModule + "initGpibServer(\"A\",\"M\",1,1)\ninitGpibServer(\"B\",\"M\",1,1)\n"),
      HasSubstr("the module \"M\" has the server \"A\" already"));
}

}  // namespace
}  // namespace mpf::test
