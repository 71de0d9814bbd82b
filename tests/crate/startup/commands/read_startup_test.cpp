// SPDX-License-Identifier: MIT
#include "crate/startup/commands/read_startup.h"

#include "crate/config/process_plan.h"
#include "crate/config/read_crate.h"
#include "crate/config/write_crate.h"
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

using ReadStartup = StartupScene;

const std::string kWhole =
    kCarrier +
    "initOctalUART(\"uart\", \"ipac\", \"IP_a\", 8, 100)\n"
    "initOctalUARTPort(\"UART[0]\", \"uart\", 0, 9600, \"N\", 1, 8, \"N\")\n"
    "initSerialServer(\"a[0]\", \"UART[0]\", 1000, 20, \"\\r\\n\", 1)\n"
    "initTtyPort(\"tty\", \"/dev/ttyS0\", 19200, \"E\", 2, 7, \"H\", 1000)\n"
    "initSerialServer(\"t\", \"tty\", 1000, 20, \"\\r\")\n"
    "dac = initDAC128V(\"DAC\", \"ipac\", \"IP_b\", 20)\n"
    "adc = initIp330(\"adc\", \"ipac\", \"IP_c\", \"D\", \"-5to5\", 0, 15, 10, 120)\n"
    "configIp330(adc, 3, \"Input\", 1000, 0)\n"
    "initIp330Scan(adc, \"scan\", 0, 15, 100, 20)\n"
    "initIp330PID(\"pid\", adc, 0, dac, 1, 20)\n"
    "initIpUnidig(\"U\", \"ipac\", \"IP_d\", 20)\n"
    "serialPortSniff(\"tty\", 10)\nrouterInit\nlocalMessageRouterStart(0)\n"
    "tcpMessageRouterServerStart(1, 9900, \"127.0.0.1\", 1500, 40)\n"
    "putenv(\"LAB=a \\\"b\\\"\")\niocInit\n";

std::vector<std::string> commandLines(const crate::Crate& crate) {
  std::vector<std::string> lines;
  for (const auto& plan : crate::planProcesses(crate, "/run/crate"))
    lines.push_back(plan.name + ": " + crate::shellText(plan));
  return lines;
}

// mpf convert and mpf run start the same programs.
TEST_F(ReadStartup, TheCrateFileOfAStartupFileStartsTheSame) {
  const auto crate = read(kWhole).crate;
  ASSERT_EQ(crate.processes.size(), 8u);

  const auto again = crate::readCrate(
      folder_.write("again.toml", crate::writeCrate(crate, "Converted from \x01 st.cmd")));

  EXPECT_EQ(commandLines(again), commandLines(crate));
  EXPECT_EQ(again.name, crate.name);
  EXPECT_EQ(crate::planProcesses(again, "x"), crate::planProcesses(crate, "x"));
}

TEST_F(ReadStartup, TheCrateHasTheNameOfTheFolder) {
  EXPECT_EQ(read("iocInit\n").crate.name, folder_.path().filename().string());
  options_.crateName = "lab";
  EXPECT_EQ(read("iocInit\n").crate.name, "lab");
}

TEST_F(ReadStartup, FoldersOfTheSiteAreKnown) {
  options_.symbols["ip"] = folder_.path().string();
  EXPECT_EQ(remarksOf(read("cd startup\ncd ip\niocInit\n")), std::vector<std::string>{});
}

TEST_F(ReadStartup, TwoProcessesHaveTwoNames) {
  const auto startup = read(kCarrier +
                            "initDAC128V(\"x\", \"ipac\", \"IP_a\", 20)\n"
                            "initTtyPort(\"x\", \"/dev/ttyS0\", 9600)\n"
                            "initSerialServer(\"y\", \"x\")\n");
  EXPECT_EQ(startup.crate.processes.at(0).name, "x");
  EXPECT_EQ(startup.crate.processes.at(1).name, "x-2");
}

// "P 0" and "P-0" would both be "P-0".
TEST_F(ReadStartup, ASnifferNeedsTheProcessOfItsPort) {
  const auto& processes = read(
                              "initTtyPort(\"P 0\", \"/dev/ttyS0\", 9600)\n"
                              "initTtyPort(\"P-0\", \"/dev/ttyS1\", 9600)\n"
                              "initTtyPort(\"P-0-2\", \"/dev/ttyS2\", 9600)\n"
                              "initSerialServer(\"a\", \"P 0\")\n"
                              "initSerialServer(\"b\", \"P-0\")\n"
                              "initSerialServer(\"c\", \"P-0-2\")\n"
                              "serialPortSniff(\"P-0\", 10)\n")
                              .crate.processes;

  ASSERT_EQ(processes.size(), 4u);
  EXPECT_EQ(processes[0].name, "P-0");
  EXPECT_EQ(processes[1].name, "P-0-3");
  EXPECT_EQ(processes[2].name, "P-0-2");
  EXPECT_EQ(processes[3].needs, std::vector<std::string>{"P-0-3"});
}

TEST_F(ReadStartup, AServerNameTwiceIsAnErrorAtTheSecondLine) {
  EXPECT_THAT(errorOf("initTtyPort(\"p\", \"/dev/ttyS0\", 9600)\n"
                      "initTtyPort(\"q\", \"/dev/ttyS1\", 9600)\n"
                      "initSerialServer(\"s\", \"p\")\ninitSerialServer(\"s\", \"q\")\n"),
              HasSubstr("the server \"s\" is also in the process \"p\""));
}

TEST_F(ReadStartup, AFileThatStartsNothingIsAnError) {
  EXPECT_THAT(errorOf("routerInit\n"), HasSubstr("no command of the file starts a server"));
  EXPECT_THAT(errorOf(""), HasSubstr("no command of the file starts a server"));
  EXPECT_THROW(static_cast<void>(startup::readStartup(folder_.file("none.cmd"), options_)),
               ConfigError);
}

TEST(IsStartupFile, TellsThemByTheirNames) {
  EXPECT_FALSE(startup::isStartupFile("lab.toml"));
  EXPECT_TRUE(startup::isStartupFile("st.cmd"));
  EXPECT_TRUE(startup::isStartupFile("st.cmd.solaris"));
}

}  // namespace
}  // namespace mpf::test
