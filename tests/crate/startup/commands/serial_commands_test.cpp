// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using SerialCommands = StartupScene;

TEST_F(SerialCommands, AllPortsOfAModuleAreServedByOneProcess) {
  const auto startup =
      read(kCarrier +
           "initOctalUART(\"uart\", \"ipac\", \"IP_a\", 8, 100)\n"
           "initOctalUARTPort(\"UART[1]\", \"uart\", 1, 19200, \"E\", 2, 7, \"H\") /* meter */\n"
           "initOctalUARTPort(\"UART[0]\", \"uart\", 0, 9600, \"N\", 1, 8, \"N\")\n"
           "initSerialServer(\"a[1]\", \"UART[1]\", 1000, 20, \"\\r\\n\", 1)\n"
           "initSerialServer(\"a[0]\", \"UART[0]\", 0, 0, \"\", 0)\n");

  EXPECT_THAT(
      settingsOf(startup, "uart"),
      ElementsAre("octal-uart=uart,ipac,IP_a,8,100", "octal-port=UART[1],uart,1,19200,E,2,7,H",
                  "octal-port=UART[0],uart,0,9600,N,1,8,N", "server=a[1],UART[1],1000,20,\\r\\n,1",
                  "server=a[0],UART[0],,,none,0"));
  EXPECT_EQ(startup.crate.processes.size(), 1u);
  EXPECT_EQ(startup.crate.processes.at(0).comment,
            "st.cmd:3: initOctalUART(\"uart\", \"ipac\", \"IP_a\", 8, 100)");
}

TEST_F(SerialCommands, OtherPortsHaveAProcessEach) {
  const auto startup = read(
      "initTtyPort(\"one\", \"/dev/ttyS0\", 19200, \"O\", 2, 7, \"N\", 1000)\n"
      "initInetPort(\"two\", \"moxa\", 4001, 1000)\n"
      "initSerialServer(\"first\", \"one\", 1000, 20, \"\")\n"
      "initSerialServer(\"second\", \"two\", 1000, 20, \"\\x03,\")\n");

  EXPECT_THAT(settingsOf(startup, "one"),
              ElementsAre("server=first,/dev/ttyS0,1000,20,none,1", "wait=true", "baud=19200",
                          "parity=O", "stop-bits=2", "bits=7", "flow=N"));
  EXPECT_THAT(settingsOf(startup, "two"),
              ElementsAre("server=second,tcp:moxa:4001,1000,20,\\x03\\x2c,1", "wait=true"));
}

TEST_F(SerialCommands, APortWithoutServerIsNotServed) {
  const auto startup = read(
      "initTtyPort(\"one\", \"/dev/ttyS0\", 9600)\n"
      "initTtyPort(\"two\", \"/dev/ttyS1\", 9600)\n"
      "initSerialServer(\"s\", \"two\")\n");
  EXPECT_EQ(startup.crate.processes.size(), 1u);
}

TEST_F(SerialCommands, EscapesOfIocshAreReplaced) {
  const auto startup = read(
      "#!mpf-ioc\n< envPaths\ninitTtyPort(\"p\", \"/dev/ttyS0\", 9600)\n"
      "initSerialServer(\"s\", \"p\", 1000, 20, \"\\r\")\n");
  EXPECT_EQ(settingsOf(startup, "p").at(0), "server=s,/dev/ttyS0,1000,20,\\r,1");
}

TEST_F(SerialCommands, ASniffNeedsTheServerOfItsPort) {
  const std::string server =
      "initTtyPort(\"port\", \"/dev/ttyS0\", 9600)\n"
      "initSerialServer(\"server\", \"port\")\n";
  const auto startup = read(server + "serialPortSniff(\"port\", 1000)\n");

  const auto& sniffer = startup.crate.processes.at(1);
  EXPECT_THAT(sniffer.command, ElementsAre("mpf", "sniff", "server", "1000"));
  EXPECT_THAT(sniffer.needs, ElementsAre("port"));
  EXPECT_EQ(sniffer.supervision.restart, crate::Restart::never);
  EXPECT_THAT(errorOf("serialPortPeek(\"port\", 10)\n" + server),
              HasSubstr("1:16: error: serialPortPeek: the port \"port\" has no serial server"));
}

TEST_F(SerialCommands, RefuseWhatDoesNotExistYet) {
  EXPECT_THAT(errorOf("initOctalUARTPort(\"p\", \"uart\", 0, 9600, \"N\", 1, 8, \"N\")\n"),
              HasSubstr("1:24: error: initOctalUARTPort: there is no module \"uart\""));
  EXPECT_THAT(errorOf("initSerialServer(\"s\", \"UART[0]\", 1000, 20, \"\\r\", 1)\n"),
              HasSubstr("1:23: error: initSerialServer: there is no port \"UART[0]\"; "));
  EXPECT_THAT(errorOf("initTtyPort(\"UART[1]\", \"/dev/ttyS0\", 9600)\n"
                      "initSerialServer(\"s\", \"UART[0]\", 1000, 20, \"\\r\", 1)\n"),
              HasSubstr("there is no port \"UART[0]\" at this line; did you mean \"UART[1]\""));
}

TEST_F(SerialCommands, RefuseInvalidArguments) {
  const std::string uart = kCarrier + "initOctalUART(\"u\", \"ipac\", \"IP_a\", 8, 100)\n";
  EXPECT_THAT(errorOf(uart + "initOctalUARTPort(\"p\", \"u\", 8, 9600, \"N\", 1, 8, \"N\")\n"),
              HasSubstr("4:29: error: initOctalUARTPort: number of the port is 8; it must be "
                        "between 0 and 7"));
  EXPECT_THAT(errorOf(uart + "initOctalUARTPort(\"p\", \"u\", 0, 9600, \"X\", 1, 8, \"N\")\n"),
              HasSubstr("parity is \"X\"; write one of the letters NEO"));
  EXPECT_THAT(errorOf(uart + uart.substr(kCarrier.size())),
              HasSubstr("4:15: error: initOctalUART: the module \"u\" exists already"));
  EXPECT_THAT(errorOf("initTtyPort(\"p\", \"/dev/ttyS0\", 9600)\n"
                      "initTtyPort(\"p\", \"/dev/ttyS1\", 9600)\n"),
              HasSubstr("2:13: error: initTtyPort: the port \"p\" exists already"));
  EXPECT_THAT(errorOf("initTtyPort(\"p\", \"/dev/ttyS0\", 9600)\n"
                      "initSerialServer(\"s\", \"p\", 1000, 20, \"abc\")\n"),
              HasSubstr("2:38: error: initSerialServer: eom has 3 bytes"));
}

// The server of the crate would not start.
TEST_F(SerialCommands, RefuseWhatTheServerRefuses) {
  const std::string uart = kCarrier + "initOctalUART(\"u\", \"ipac\", \"IP_a\", 8, 100)\n";
  const std::string port = "initOctalUARTPort(\"p\", \"u\", 0, 9600, \"N\", 1, 8, \"N\")\n";
  EXPECT_THAT(errorOf(kCarrier + "initOctalUART(\"u\", \"ipac\", \"IP_a\", 5, 100)\n"),
              HasSubstr("3:36: error: initOctalUART: nports is 5; a module has 4 or 8"));
  EXPECT_THAT(errorOf(uart + "initOctalUARTPort(\"p\", \"u\", 0, 9601, \"N\", 1, 8, \"N\")\n"),
              HasSubstr("4:32: error: initOctalUARTPort: baud 9601: the chip supports 75, "));
  EXPECT_THAT(errorOf(uart + port + "initOctalUARTPort(\"q\", \"u\", 0, 9600)\n"),
              HasSubstr("5:29: error: initOctalUARTPort: port 0 of the module \"u\" is the port "
                        "\"p\" already"));
  EXPECT_THAT(errorOf(uart + port + "initSerialServer(\"s\", \"p\", 1000, 20000, \"\\r\")\n"),
              HasSubstr("5:34: error: initSerialServer: queueSize is 20000; it must be between 0 "
                        "and 16384"));
  EXPECT_THAT(
      errorOf(uart + port + "initSerialServer(\"s\", \"p\")\ninitSerialServer(\"t\", \"p\")\n"),
      HasSubstr("6:23: error: initSerialServer: the port \"p\" has the server \"s\" "
                "already"));
}

TEST_F(SerialCommands, RepeatNoErrorOfTheirModuleOrPort) {
  try {
    static_cast<void>(read(kCarrier + "initOctalUART(\"u\", \"ipac\", \"IP_a\", 5, 100)\n"
                                      "initOctalUARTPort(\"p\", \"u\", 0, 9601)\n"
                                      "initSerialServer(\"s\", \"p\", 1000, 20, \"\\r\")\n"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("nports is 5"));
    EXPECT_THAT(error.what(), HasSubstr("baud 9601"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("there is no")));
  }
}

// Both errors of a line, and those of later lines, are reported at once.
TEST_F(SerialCommands, ReportAllErrors) {
  try {
    static_cast<void>(
        read("initTtyPort(\"p\", \"/dev/ttyS0\", 0, \"N\", 3)\n"
             "initSerialServer(\"s\", \"q\", 1000, 20000)\n"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("baud is 0"));
    EXPECT_THAT(error.what(), HasSubstr("stopBits is 3"));
    EXPECT_THAT(error.what(), HasSubstr("there is no port \"q\""));
    EXPECT_THAT(error.what(), HasSubstr("queueSize is 20000"));
  }
}

}  // namespace
}  // namespace mpf::test
