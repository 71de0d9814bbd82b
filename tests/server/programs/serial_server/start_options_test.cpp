// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/start_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/programs/command_line.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::SizeIs;

std::optional<int> parseSerial(SerialStartOptions& options, const std::vector<std::string>& words) {
  return statusOf([&](int argc, char** argv) { return options.parse(argc, argv); }, words);
}

std::string serialComplaint(const std::vector<std::string>& words) {
  SerialStartOptions options;
  return usageErrorOf([&](int argc, char** argv) { return options.parse(argc, argv); }, words);
}

TEST(SerialStartOptions, HaveTheDefaultsOfTheOldCommand) {
  SerialStartOptions options;
  ASSERT_EQ(parseSerial(options, {"dmm", "/dev/ttyS0"}), std::nullopt);

  ASSERT_THAT(options.servers, SizeIs(1));
  const auto& start = options.servers[0];
  EXPECT_EQ(start.server, "dmm");
  EXPECT_EQ(start.port, "/dev/ttyS0");
  EXPECT_EQ(start.queueSize, 20);
  EXPECT_EQ(start.serial.eom, "\r");
  EXPECT_EQ(start.serial.bufferBytes, SerialServerOptions().bufferBytes);
  EXPECT_TRUE(start.serial.circularBuffer);
  EXPECT_EQ(options.describeLine("/dev/ttyS0"), "9600 baud, 8N1, no flow control");
}

TEST(SerialStartOptions, HaveTheOrderOfTheOldCommand) {
  SerialStartOptions options;
  ASSERT_EQ(
      parseSerial(options, {"dmm", "/dev/ttyS0", "500", "30", "\\r\\n", "0", "--baud", "19200",
                            "--bits", "7", "--parity", "E", "--stop-bits", "2", "--flow", "H"}),
      std::nullopt);

  const auto& start = options.servers.at(0);
  EXPECT_EQ(start.serial.bufferBytes, 500U);
  EXPECT_EQ(start.queueSize, 30);
  EXPECT_EQ(start.serial.eom, "\r\n");
  EXPECT_FALSE(start.serial.circularBuffer);
  EXPECT_EQ(options.describeLine("/dev/ttyS0"), "19200 baud, 7E2, hardware flow control");
}

TEST(SerialStartOptions, AnOptionAddsServersWithTheFieldsOfTheArguments) {
  SerialStartOptions options;
  ASSERT_EQ(parseSerial(options, {"a", "/dev/ttyS0", "--server", "b,tcp:host:4001,500,30,\\n,0",
                                  "--server", "c,/dev/ttyS1"}),
            std::nullopt);

  ASSERT_THAT(options.servers, SizeIs(3));
  const auto& second = options.servers[1];
  EXPECT_EQ(second.server, "b");
  EXPECT_EQ(second.port, "tcp:host:4001");
  EXPECT_EQ(second.serial.bufferBytes, 500U);
  EXPECT_EQ(second.queueSize, 30);
  EXPECT_EQ(second.serial.eom, "\n");
  EXPECT_FALSE(second.serial.circularBuffer);
  EXPECT_EQ(options.servers[2].serial.eom, "\r");
}

TEST(SerialStartOptions, TheEndOfAMessageMayBeEmpty) {
  SerialStartOptions options;
  ASSERT_EQ(parseSerial(options, {"dmm", "/dev/ttyS0", "500", "30", ""}), std::nullopt);

  EXPECT_EQ(options.servers.at(0).serial.eom, "");
}

TEST(SerialStartOptions, AServerWithoutEndOfMessageHasNone) {
  SerialStartOptions options;
  ASSERT_EQ(
      parseSerial(options, {"a", "/dev/ttyS0", "500", "30", "none", "--server",
                            "b,/dev/ttyS1,500,30,none", "--server", "c,/dev/ttyS2,500,30,,1"}),
      std::nullopt);

  EXPECT_EQ(options.servers.at(0).serial.eom, "");
  EXPECT_EQ(options.servers.at(1).serial.eom, "");
  EXPECT_EQ(options.servers.at(2).serial.eom, "\r") << "an empty field is the default";
}

TEST(SerialStartOptions, LimitsApplyToAllServers) {
  SerialStartOptions options;
  ASSERT_EQ(parseSerial(options,
                        {"a", "/dev/ttyS0", "--server", "b,/dev/ttyS1", "--quiet-time", "250ms"}),
            std::nullopt);

  for (const auto& start : options.servers) EXPECT_EQ(start.serial.limits.quietTime, 250ms);
}

TEST(SerialStartOptions, DescribeEachKindOfLine) {
  SerialStartOptions options;
  ASSERT_EQ(parseSerial(options, {"a", "U[0]", "--octal-uart", "U,ipac,IP_a,8", "--octal-port",
                                  "U[0],U,0,38400,O,1,7,N", "--server", "b,tcp:host:4001"}),
            std::nullopt);

  EXPECT_EQ(options.describeLine("U[0]"), "38400 baud, 7O1, no flow control");
  EXPECT_EQ(options.describeLine("tcp:host:4001"), "a terminal server");
}

TEST(SerialStartOptions, APortOfATerminalServerHasAnAddress) {
  EXPECT_EQ(tcpAddressOf("tcp:host:4001"), "host:4001");
  EXPECT_EQ(tcpAddressOf("/dev/ttyS0"), std::nullopt);
}

TEST(SerialStartOptions, NeedAServerWithAPort) {
  EXPECT_THAT(serialComplaint({}), HasSubstr("server is required"));
  EXPECT_THAT(serialComplaint({"dmm"}), HasSubstr("port is required"));
}

TEST(SerialStartOptions, RefuseContradictions) {
  EXPECT_THAT(serialComplaint({"a", "/dev/ttyS0", "--server", "b,/dev/ttyS0"}),
              HasSubstr("port /dev/ttyS0: has two servers; a line can have only one"));
  EXPECT_THAT(serialComplaint({"a", "x", "--octal-port", "x,V,0"}),
              HasSubstr("--octal-port: x: no --octal-uart has the name V"));
  EXPECT_THAT(serialComplaint({"a", "x", "--octal-uart", "U,ipac,IP_a,8", "--octal-port", "x,U,0",
                               "--octal-port", "x,U,1"}),
              HasSubstr("--octal-port: x: two ports have that name"));
  EXPECT_THAT(serialComplaint({"a", "tcp:host:4001", "--parity", "E"}),
              HasSubstr("--parity is for terminal devices, and no port is one"));
}

TEST(SerialStartOptions, RefuseInvalidFields) {
  EXPECT_THAT(serialComplaint({"a", "x", "500", "30", "\\q"}),
              HasSubstr("eomstr: \\q: use 1 or 2 bytes"));
  EXPECT_THAT(serialComplaint({"a", "x", "500", "30", "abc"}),
              HasSubstr("eomstr: abc: use 1 or 2 bytes"));
  EXPECT_THAT(serialComplaint({"--server", "a,x,0"}),
              HasSubstr("longest answer 0: use 1 to 1048576 bytes"));
  EXPECT_THAT(serialComplaint({"--server", "a,x,1,99999"}),
              HasSubstr("queue size 99999: use 1 to 16384"));
  EXPECT_THAT(serialComplaint({"--server", "a,x,1,20,abc"}),
              HasSubstr("end of message abc: use 1 or 2 bytes"));
}

}  // namespace
}  // namespace mpf::test
