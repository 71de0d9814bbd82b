// SPDX-License-Identifier: MIT
// Valid configuration files.
#include <unistd.h>

#include <array>
#include <grp.h>

#include "tests/router/certificates.h"
#include "tests/router/config/config_fixture.h"

namespace mpf::router::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kOneRemote = R"(
[[remote]]
locations = 1
address = "ioc1:9900"
security = "plain"
)";

std::string ownHostName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

TEST_F(ConfigTest, AFewLinesAreEnough) {
  const auto config = load(kOneRemote);

  ASSERT_EQ(config.remotes.size(), 1U);
  EXPECT_EQ(config.remotes[0], (Remote{{1}, {"ioc1", 9900}, Security::plain, {}}));
  EXPECT_EQ(config.name, ownHostName().substr(0, 63));
  EXPECT_EQ(config.backplane, "") << "$MPF_BACKPLANE, or \"default\"";
  EXPECT_EQ(config.rights, Rights());
  EXPECT_EQ(config.limits, Limits());
  EXPECT_EQ(config.logLevel, "info");
  EXPECT_FALSE(config.allowPublicPlain);
  EXPECT_THAT(config.serve, IsEmpty());
  EXPECT_THAT(config.listen, IsEmpty());
  EXPECT_THAT(config.allow, IsEmpty());
}

TEST_F(ConfigTest, ReadsEveryKey) {
  const auto* group = ::getgrgid(::getegid());
  ASSERT_NE(group, nullptr);
  const auto tls = Certificates(folder_, "all").files("ioc7.lab");
  std::filesystem::rename(tls.certificate, folder_.file("ours.pem"));
  std::filesystem::rename(tls.key, folder_.file("ours.key"));

  const auto config = load(std::string("group = \"") + group->gr_name + R"("
name = "crate 7"
backplane = "crate7"
mode = "0660"
log-level = "debug"
allow-public-plain = true

[tls]
certificate = "ours.pem"
key = "ours.key"
authorities = "all.pem"

[limits]
queue-size = 40
buffer-size = 1500
max-message-size = "8MiB"
window-size = "64KiB"
max-clients = 10
max-connections = 3
dead-time = "1min"
handshake-time = "4s"
first-retry = "50ms"
last-retry = "2s"

[[serve]]
location = 1
local = 0

[[serve]]
location = 3

[[listen]]
address = "*:9900"

[[listen]]
address = "192.0.2.1:9901"
security = "plain"

[[remote]]
locations = [-7, 2]
address = "[fd00::0:7]:9900"
security = "tls"
tls-name = "ioc7.lab"

[[remote]]
locations = [4]
address = "ioc4.lab:9900"

[[allow]]
peer = "ioc*.lab"
locations = [1, 3]
servers = ["serial*", "dac"]

[[allow]]
servers = "Int32"
)");

  EXPECT_EQ(config.name, "crate 7");
  EXPECT_EQ(config.backplane, "crate7");
  EXPECT_EQ(config.rights, (Rights{0660, ::getegid()}));
  EXPECT_EQ(config.logLevel, "debug");
  EXPECT_TRUE(config.allowPublicPlain);
  EXPECT_EQ(config.tls,
            (TlsFiles{folder_.file("ours.pem"), folder_.file("ours.key"), folder_.file("all.pem")}))
      << "paths are relative to the folder of the file";
  EXPECT_EQ(config.limits, (Limits{40, 1500, 8u << 20, 64u << 10, 10, 3, 60s, 4s, 50ms, 2s}));
  EXPECT_THAT(config.serve, ElementsAre(Serve{1, 0}, Serve{3, 3}));
  EXPECT_THAT(config.listen, ElementsAre(Listen{{"*", 9900}, Security::tls},
                                         Listen{{"192.0.2.1", 9901}, Security::plain}));
  EXPECT_THAT(config.remotes,
              ElementsAre(Remote{{-7, 2}, {"fd00::7", 9900}, Security::tls, "ioc7.lab"},
                          Remote{{4}, {"ioc4.lab", 9900}, Security::tls, "ioc4.lab"}));
  EXPECT_THAT(config.allow, ElementsAre(Allow{"ioc*.lab", {1, 3}, {"serial*", "dac"}},
                                        Allow{"*", {}, {"Int32"}}));
}

TEST_F(ConfigTest, TlsFilesAreNotReadWhenNoConnectionUsesTls) {
  EXPECT_EQ(
      complaintOf(std::string("[tls]\ncertificate = \"a\"\nkey = \"b\"\nauthorities = \"c\"\n") +
                  kOneRemote),
      "nothing");
}

TEST_F(ConfigTest, PlainTcpIsAllowedWithAddressesThatAreNotPublic) {
  for (const std::string address :
       {"127.0.0.1:0", "10.1.2.3:1", "172.31.0.1:1", "192.168.0.1:1", "169.254.1.1:1", "[::1]:1",
        "[fd00::7]:1", "[fe80::1]:1", "localhost:1"}) {
    EXPECT_EQ(complaintOf("[[serve]]\nlocation=1\n[[listen]]\naddress = \"" + address +
                          "\"\nsecurity = \"plain\"\n"),
              "nothing")
        << address;
  }
}

TEST_F(ConfigTest, SeveralListenersMayHavePort0) {
  EXPECT_EQ(
      complaintOf("[[serve]]\nlocation=1\n" +
                  std::string("[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n") +
                  "[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n"),
      "nothing");
}

}  // namespace
}  // namespace mpf::router::test
