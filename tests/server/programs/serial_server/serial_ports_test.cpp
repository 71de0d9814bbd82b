// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/serial_ports.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/programs/command_line.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class SerialPortsTest : public testing::Test {
 protected:
  void parse(const std::vector<std::string>& words) {
    ASSERT_EQ(statusOf([this](int argc, char** argv) { return options_.parse(argc, argv); }, words),
              std::nullopt);
  }
  // Opens the ports, which fails. Returns the text of the exception.
  template <class Exception>
  std::string failureOf(const std::vector<std::string>& words) {
    parse(words);
    try {
      const SerialPorts ports(options_, log_);
    } catch (const Exception& error) {
      return error.what();
    }
    return {};
  }

  TemporaryFolder folder_;
  ServerLog log_{"test", "off"};
  SerialStartOptions options_;
};

TEST_F(SerialPortsTest, OpenThePortsOfAModuleOnItsCarrier) {
  parse({"--carrier", "ipac=model", "--octal-uart", "U,ipac,IP_a,8", "--octal-port", "x,U,0",
         "--octal-port", "y,U,7", "--server", "a,x", "--server", "b,y"});

  const SerialPorts ports(options_, log_);

  EXPECT_EQ(ports.find("x").description(), "port 0 of U (carrier ipac, site IP_a)");
  EXPECT_EQ(ports.find("y").description(), "port 7 of U (carrier ipac, site IP_a)");
  EXPECT_EQ(ports.find("x").state(), SerialPortState::plugged);
}

TEST_F(SerialPortsTest, RefuseAPortThatTheModuleDoesNotHave) {
  EXPECT_THAT(failureOf<std::invalid_argument>({"a", "x", "--carrier", "ipac=model", "--octal-uart",
                                                "U,ipac,IP_a,8", "--octal-port", "x,U,8"}),
              HasSubstr("port 8: the module has ports 0 to 7"));
}

// A module that appears later would not mend it.
TEST_F(SerialPortsTest, RefuseAPortThatAMissingModuleCannotHave) {
  EXPECT_THAT(
      failureOf<std::invalid_argument>({"a", "x", "--wait", "--carrier", "ipac=tpci200:9",
                                        "--octal-uart", "U,ipac,IP_a,8", "--octal-port", "x,U,8"}),
      HasSubstr("the module has ports 0 to 7"));
}

TEST_F(SerialPortsTest, RefuseSettingsThatAMissingModuleCannotHave) {
  EXPECT_THAT(failureOf<std::invalid_argument>({"a", "x", "--wait", "--carrier", "ipac=tpci200:9",
                                                "--octal-uart", "U,ipac,IP_a,8", "--octal-port",
                                                "x,U,0,57600"}),
              HasSubstr("baud 57600: the chip supports"));
}

TEST_F(SerialPortsTest, WithWaitAPortOfAMissingModuleIsUnplugged) {
  parse({"a", "x", "--wait", "--carrier", "ipac=tpci200:9", "--octal-uart", "U,ipac,IP_a,8",
         "--octal-port", "x,U,3"});

  const SerialPorts ports(options_, log_);

  EXPECT_EQ(ports.find("x").state(), SerialPortState::unplugged);
  EXPECT_EQ(ports.find("x").description(), "port 3 of U (carrier ipac, site IP_a)");
}

TEST_F(SerialPortsTest, AMissingTerminalIsAnErrorWithoutWait) {
  const auto path = folder_.file("line");

  EXPECT_THAT(failureOf<std::runtime_error>({"a", path}), HasSubstr(path));
}

TEST_F(SerialPortsTest, WithWaitAMissingTerminalIsUnplugged) {
  const auto path = folder_.file("line");
  parse({"a", path, "--wait"});

  const SerialPorts ports(options_, log_);

  EXPECT_EQ(ports.find(path).state(), SerialPortState::unplugged);
}

TEST_F(SerialPortsTest, RefuseAnInvalidAddressOfATerminalServer) {
  EXPECT_NE(failureOf<std::invalid_argument>({"a", "tcp:host"}), "");
}

}  // namespace
}  // namespace mpf::test
