// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using RouterCommands = StartupScene;

TEST_F(RouterCommands, AServerRouterOffersTheServersOfThisHost) {
  const auto startup = read(
      "tcpMessageRouterServerStart(1,9900,\"10.0.0.7\",1500,40)\n"
      "routerInit\nlocalMessageRouterStart(3)\n");

  EXPECT_THAT(settingsOf(startup, "router-server-9900"),
              ElementsAre("queue-size=40", "buffer-size=1500", "plain=true",
                          "allow-public-plain=true", "serve=1=3", "listen=10.0.0.7:9900"));
  EXPECT_EQ(startup.crate.location, 3);
}

TEST_F(RouterCommands, AClientRouterConnectsToAnotherHost) {
  const auto startup = read(
      "routerInit\nlocation = 1\naddress = \"10.0.0.7\"\n"
      "tcpMessageRouterClientStart location, 9900, address, 10000, 100\n");

  EXPECT_THAT(settingsOf(startup, "router-client-9900"),
              ElementsAre("queue-size=100", "buffer-size=10000", "plain=true",
                          "allow-public-plain=true", "remote=1=10.0.0.7:9900"));
}

TEST_F(RouterCommands, AnotherAddressCanBeUsed) {
  options_.address = "127.0.0.1";
  const auto startup = read("tcpMessageRouterClientStart(1, 9900, \"#.#.#.#\", 1500, 40)\n");
  EXPECT_EQ(settingsOf(startup, "router-client-9900").back(), "remote=1=127.0.0.1:9900");
}

TEST_F(RouterCommands, MayBeRepeatedWithTheSameLocation) {
  const std::string port =
      "initTtyPort(\"p\", \"/dev/ttyS0\", 9600)\ninitSerialServer(\"s\", \"p\")\n";
  const std::string start = "routerInit\nlocalMessageRouterStart(0)\n";
  EXPECT_EQ(errorOf(start + start + port), "");
  EXPECT_THAT(errorOf(start + "localMessageRouterStart(1)\n" + port),
              HasSubstr("3:25: error: localMessageRouterStart: location 1 differs from 0"));
}

TEST_F(RouterCommands, RefuseInvalidArguments) {
  EXPECT_THAT(
      errorOf("tcpMessageRouterClientStart(1, 9900, \"#.#.#.#\", 1500, 40)\n"),
      HasSubstr("1:38: error: tcpMessageRouterClientStart: \"#.#.#.#\" is not the address"));
  EXPECT_THAT(errorOf("tcpMessageRouterClientStart(1, 9900, Remote, 1500, 40)\n"),
              HasSubstr("1:38: error: tcpMessageRouterClientStart: undefined symbol Remote"));
  EXPECT_THAT(errorOf("tcpMessageRouterServerStart(1, 99000, \"a\", 1500, 40)\n"),
              HasSubstr("TCP port is 99000"));
  EXPECT_THAT(errorOf("tcpMessageRouterServerStart(1, 9900, \"a\", 1500, 40)\n"
                      "tcpMessageRouterServerStart(1, 9900, \"a\", 1500, 40)\n"),
              HasSubstr("2:32: error: tcpMessageRouterServerStart: TCP port 9900 is used"));
}

}  // namespace
}  // namespace mpf::test
