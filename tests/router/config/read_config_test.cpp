// SPDX-License-Identifier: MIT
// readConfig() and loadConfig(): every key of a file, and the line and text of each error.
#include <unistd.h>

#include <array>
#include <grp.h>

#include "tests/router/certificates.h"
#include "tests/router/config/config_fixture.h"

// Lines of TOML end with \n here, so that one test case is one line.
// NOLINTBEGIN(modernize-raw-string-literal)
namespace mpf::router::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
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

using ReadConfigTest = ConfigTest;

TEST_F(ReadConfigTest, AFewLinesAreEnough) {
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

TEST_F(ReadConfigTest, ReadsEveryKey) {
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

TEST_F(ReadConfigTest, InvalidToml) {
  EXPECT_THAT(complaintOf("name = \"a\"\n\nname = \"b\"\n"),
              HasSubstr("router.toml:3: Error while parsing key-value pair: cannot redefine "
                        "existing string 'name'"));
  EXPECT_THAT(complaintOf("name = \n"),
              HasSubstr("router.toml:1: Error while parsing key-value pair"));
  EXPECT_THAT(complaintOf("[tls\n"), HasSubstr("router.toml:1: Error while parsing table header"));
  EXPECT_THAT(complaintOf("# \xff\n"), HasSubstr("router.toml:1: "));
}

TEST_F(ReadConfigTest, UnknownKeys) {
  expectComplaints({
      {"nam = \"a\"\n", "1: unknown key \"nam\"; did you mean \"name\"?"},
      {kRemote + "adress = \"a:1\"\n",
       "5: [[remote]]: unknown key \"adress\"; did you mean \"address\"?"},
      {kRemote + "location = 1\n",
       "5: [[remote]]: unknown key \"location\"; did you mean \"locations\"?"},
      {kServe + "locations = [1]\n",
       "3: [[serve]]: unknown key \"locations\"; did you mean \"location\"?"},
      {"[limits]\nqueue_size = 1\n",
       "2: [limits]: unknown key \"queue_size\"; did you mean \"queue-size\"?"},
      {"[tls]\n\npassword = \"x\"\n",
       "1: [tls] has no certificate; write certificate = \"ours.pem\"\n"
       "router.toml:1: [tls] has no key; write key = \"ours.key\"\n"
       "router.toml:1: [tls] has no authorities; write authorities = \"authorities.pem\"\n"
       "router.toml:3: [tls]: unknown key \"password\"; the keys are certificate, key, "
       "authorities"},
      {"[[remotes]]\nlocations = 1\n", "1: unknown key \"remotes\"; did you mean \"remote\"?"},
  });
}

TEST_F(ReadConfigTest, MissingKeys) {
  expectComplaints({
      {"\n[[serve]]\nlocal = 0\n", "2: [[serve]] has no location; write location = 1"},
      {kServe + "[[listen]]\n", "3: [[listen]] has no address; write address = \"*:9900\""},
      {"[[remote]]\naddress = \"a:1\"\n", "1: [[remote]] has no locations; write locations = [1]"},
      {"[[remote]]\nlocations = 1\n",
       "1: [[remote]] has no address; write address = \"ioc1.lab:9900\""},
      {"[tls]\ncertificate = \"a\"\nkey = \"b\"\n",
       "1: [tls] has no authorities; write authorities = \"authorities.pem\""},
  });
}

TEST_F(ReadConfigTest, ValuesOfTheWrongType) {
  expectComplaints({
      {"name = 7\n", "1: name is an integer; write a string in quotes"},
      {"name = [\n \"a\"]\n", "1: name is a list; write a string in quotes"},
      {"mode = 0.5\n", "1: mode is a number with a fraction; write a string in quotes"},
      {"allow-public-plain = \"yes\"\n", "1: allow-public-plain is a string; write true or false"},
      {"[[serve]]\nlocation = \"1\"\n", "2: location is a string; write an integer"},
      {"[[serve]]\nlocation = [1]\n", "2: location is a list; write an integer"},
      {"[[serve]]\nlocation = 3000000000\n",
       "2: location 3000000000 is out of range: use -2147483648 to 2147483647"},
      {"[[remote]]\naddress = \"a:1\"\nlocations = [\n1,\n\"2\"]\n",
       "5: locations is a string; write an integer"},
      {"[[remote]]\naddress = \"a:1\"\nlocations = []\n",
       "3: locations is an empty list; write at least one value"},
      {"[[allow]]\nservers = [1]\n", "2: servers is an integer; write strings in quotes"},
      {"[limits]\ndead-time = 2024-01-01\n",
       "2: dead-time is a date or a time; write a string in quotes"},
      {"tls = true\n", "1: tls is true or false; write [tls], once"},
      {"[[tls]]\nkey = \"a\"\n", "1: tls is a list; write [tls], once"},
      {"[listen]\naddress = \"a:1\"\n", "1: listen is a table; write [[listen]], once for each"},
      {"serve = [1]\n", "1: serve is a list; write [[serve]], once for each"},
  });
}

TEST_F(ReadConfigTest, InvalidValues) {
  expectComplaints({
      {"mode = \"0888\"\n",
       "1: mode: 0888: use an octal number between 0600 and 0666, such as 0660"},
      {"group = \"no-such-group\"\n", "1: group: no-such-group: there is no group of this name"},
      {"[[listen]]\naddress = \"a\"\n",
       "2: address: \"a\" has no port; write HOST:PORT, such as ioc1.lab:9900, 10.0.0.7:9900, "
       "[fd00::7]:9900 or, to listen, *:9900"},
      {"[[listen]]\naddress = \"a:1\"\nsecurity = \"none\"\n",
       "3: security: \"none\": write \"tls\" or \"plain\""},
      {"[limits]\ndead-time = 2\n",
       "2: dead-time: \"2\": write a time with its unit, such as 500ms, 2s or 1min"},
      {"[limits]\nqueue-size = 0\n", "2: queue-size: 0 is out of range: use 1 to 1000000"},
  });
}

TEST_F(ReadConfigTest, UnreadableFiles) {
  const auto complaintOfFile = [&](const std::string& file) -> std::string {
    try {
      static_cast<void>(loadConfig(file));
      return "nothing";
    } catch (const ConfigError& error) {
      return withoutFolder(error.what());
    }
  };

  EXPECT_EQ(complaintOfFile(folder_.file("none.toml")),
            "none.toml: cannot be read: No such file or directory");
  EXPECT_EQ(complaintOfFile(folder_.path().string()),
            folder_.path().string() + ": cannot be read: Is a directory");
}

}  // namespace
}  // namespace mpf::router::test
// NOLINTEND(modernize-raw-string-literal)
