// SPDX-License-Identifier: MIT
// Invalid configuration files: the line and the text of each error.
#include <vector>

#include "tests/router/certificates.h"
#include "tests/router/config/config_fixture.h"

// Lines of TOML end with \n here, so that one test case is one line.
// NOLINTBEGIN(modernize-raw-string-literal)
namespace mpf::router::test {
namespace {

using testing::HasSubstr;

struct Wrong {
  std::string text;
  std::string complaint;  // without "router.toml:"
};

const std::string kServe = "[[serve]]\nlocation = 1\n";
const std::string kListen = "[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n";
const std::string kRemote =
    "[[remote]]\nlocations = [2]\naddress = \"a:1\"\nsecurity = \"plain\"\n";

std::string listenAt(const std::string& address) {
  return kServe + "[[listen]]\naddress = \"" + address + "\"\n";
}
std::string remoteAt(const std::string& address) {
  return "[[remote]]\nlocations = [2]\naddress = \"" + address + "\"\n";
}

class ConfigErrorTest : public ConfigTest {
 protected:
  void expectComplaints(const std::vector<Wrong>& all) {
    for (const auto& [text, complaint] : all)
      EXPECT_EQ(complaintOf(text), "router.toml:" + complaint) << text;
  }
};

TEST_F(ConfigErrorTest, InvalidToml) {
  EXPECT_THAT(complaintOf("name = \"a\"\n\nname = \"b\"\n"),
              HasSubstr("router.toml:3: Error while parsing key-value pair: cannot redefine "
                        "existing string 'name'"));
  EXPECT_THAT(complaintOf("name = \n"),
              HasSubstr("router.toml:1: Error while parsing key-value pair"));
  EXPECT_THAT(complaintOf("[tls\n"), HasSubstr("router.toml:1: Error while parsing table header"));
  EXPECT_THAT(complaintOf("# \xff\n"), HasSubstr("router.toml:1: "));
}

TEST_F(ConfigErrorTest, UnknownKeys) {
  expectComplaints({
      {"nam = \"a\"\n", "1: unknown key \"nam\"; did you mean \"name\"?"},
      {kRemote + "adress = \"a:1\"\n",
       "5: [[remote]]: unknown key \"adress\"; did you mean \"address\"?"},
      {"[[remote]]\nlocation = 1\n",
       "2: [[remote]]: unknown key \"location\"; did you mean \"locations\"?"},
      {kServe + "locations = [1]\n",
       "3: [[serve]]: unknown key \"locations\"; did you mean \"location\"?"},
      {"[limits]\nqueue_size = 1\n",
       "2: [limits]: unknown key \"queue_size\"; did you mean \"queue-size\"?"},
      {"[tls]\n\npassword = \"x\"\n",
       "3: [tls]: unknown key \"password\"; the keys are certificate, key, authorities"},
      {"[[remotes]]\nlocations = 1\n", "1: unknown key \"remotes\"; did you mean \"remote\"?"},
  });
}

TEST_F(ConfigErrorTest, MissingKeys) {
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

TEST_F(ConfigErrorTest, ValuesOfTheWrongType) {
  expectComplaints({
      {"name = 7\n", "1: name is an integer; write a string in quotes"},
      {"name = [\n \"a\"]\n", "1: name is a list; write a string in quotes"},
      {"mode = 0.5\n", "1: mode is a number with a fraction; write a string in quotes"},
      {"allow-public-plain = \"yes\"\n", "1: allow-public-plain is a string; write true or false"},
      {"[[serve]]\nlocation = \"1\"\n", "2: location is a string; write an integer"},
      {"[[serve]]\nlocation = [1]\n", "2: location is a list; write an integer"},
      {"[[serve]]\nlocation = 3000000000\n",
       "2: location 3000000000 is out of range: use -2147483648 to 2147483647"},
      {"[[remote]]\nlocations = [\n1,\n\"2\"]\n", "4: locations is a string; write an integer"},
      {"[[remote]]\nlocations = []\n", "2: locations is an empty list; write at least one value"},
      {"[[allow]]\nservers = [1]\n", "2: servers is an integer; write strings in quotes"},
      {"[limits]\ndead-time = 2024-01-01\n",
       "2: dead-time is a date or a time; write a string in quotes"},
      {"tls = true\n", "1: tls is true or false; write [tls], once"},
      {"[[tls]]\nkey = \"a\"\n", "1: tls is a list; write [tls], once"},
      {"[listen]\naddress = \"a:1\"\n", "1: listen is a table; write [[listen]], once for each"},
      {"serve = [1]\n", "1: serve is a list; write [[serve]], once for each"},
  });
}

TEST_F(ConfigErrorTest, InvalidValues) {
  expectComplaints({
      {"mode = \"0888\"\n",
       "1: mode: 0888: use an octal number between 0600 and 0666, such as 0660"},
      {"group = \"no-such-group\"\n", "1: group: no-such-group: there is no group of this name"},
      {"group = \"root\"\n" + kRemote,
       "1: the mode gives this group no access; write mode 0660, too"},
      {"log-level = \"loud\"\n" + kRemote,
       "1: log-level \"loud\": use trace, debug, info, warning, error, critical, off"},
      {"\nname = \"a\\tb\"\n" + kRemote, "2: name \"a\tb\": use 1 to 63 printable characters"},
      {"backplane = \"a.b\"\n" + kRemote,
       "1: backplane name \"a.b\": use 1 to 39 of the characters A-Z a-z 0-9 _ -"},
      {"[[listen]]\naddress = \"a\"\n",
       "2: address: \"a\" has no port; write HOST:PORT, such as ioc1.lab:9900, 10.0.0.7:9900, "
       "[fd00::7]:9900 or, to listen, *:9900"},
      {"[[listen]]\nsecurity = \"none\"\n", "2: security: \"none\": write \"tls\" or \"plain\""},
      {"[limits]\ndead-time = 2\n",
       "2: dead-time: \"2\": write a time with its unit, such as 500ms, 2s or 1min"},
      {"[limits]\nqueue-size = 0\n", "2: queue-size: 0 is out of range: use 1 to 1000000"},
      {"[limits]\nfirst-retry = \"9s\"\n" + kRemote,
       "2: first-retry, 9000 ms, is longer than last-retry, 5000 ms"},
  });
}

TEST_F(ConfigErrorTest, ARouterWithNothingToDo) {
  expectComplaints({
      {"",
       "1: nothing to do: write [[serve]] and [[listen]] to offer servers of this host to other "
       "hosts, or [[remote]] to reach servers of other hosts"},
      {"\n" + kServe, "2: no client can reach the served locations; write [[listen]], too"},
      {kListen, "1: this router listens, but serves no location; write [[serve]], too"},
      {kRemote + "[[allow]]\n", "5: [[allow]] without [[serve]]: there is nothing to allow"},
  });
}

TEST_F(ConfigErrorTest, DuplicateLocationsAndAddresses) {
  expectComplaints({
      {kServe + kServe + kListen, "4: location 1 is served twice; write it once"},
      {kRemote + kRemote, "6: location 2 appears twice in remotes; write it once"},
      {"[[remote]]\nlocations = [3, 3]\naddress = \"a:1\"\nsecurity = \"plain\"\n",
       "2: location 3 appears twice in remotes; write it once"},
      {"[[serve]]\nlocation = 2\nlocal = 0\n" + kListen + kRemote,
       "8: location 2 is remote here, but served by this host at router.toml:2; use "
       "another location"},
      {"[[serve]]\nlocation = 5\nlocal = 2\n" + kListen + kRemote,
       "8: location 2 is remote here, but served by this host at router.toml:3; use "
       "another location"},
      {kServe + kListen + kListen +
           "[[listen]]\naddress = \"10.0.0.1:7\"\nsecurity = \"plain\"\n[[listen]]\naddress = "
           "\"10.0.0.1:7\"\n",
       "13: 10.0.0.1:7 appears twice; write it once"},
      {kServe + kListen + "[[allow]]\nlocations = [1,\n 2]\n", "7: location 2 is not served here"},
  });
}

TEST_F(ConfigErrorTest, AddressesThatCannotBeConnectedTo) {
  expectComplaints({
      {remoteAt("*:9900"),
       "3: *:9900 is a wildcard address to listen on; write the address of one host"},
      {remoteAt("[::]:9900"),
       "3: [::]:9900 is a wildcard address to listen on; write the address of one host"},
      {remoteAt("ioc1:0"), "3: ioc1:0: the port must be 1 to 65535"},
  });
}

TEST_F(ConfigErrorTest, PlainTcpWithPublicAddresses) {
  const auto how =
      ": use TLS, or a loopback, private or link-local address, or write allow-public-plain = true";
  expectComplaints({
      {listenAt("*:9900") + "security = \"plain\"\n",
       std::string("5: plain TCP at *:9900, which is every network of this host") + how},
      {listenAt("[::]:9900") + "security = \"plain\"\n",
       std::string("5: plain TCP at [::]:9900, which is every network of this host") + how},
      {listenAt("8.8.8.8:9900") + "security = \"plain\"\n",
       std::string("5: plain TCP at 8.8.8.8:9900, which is a public address") + how},
      {remoteAt("[2001:db8::1]:99") + "\nsecurity = \"plain\"\n",
       std::string("5: plain TCP at [2001:db8::1]:99, which is a public address") + how},
  });
  EXPECT_EQ(
      complaintOf("allow-public-plain = true\n" + listenAt("*:9900") + "security = \"plain\"\n"),
      "nothing");
}

TEST_F(ConfigErrorTest, Patterns) {
  expectComplaints({
      {kServe + kListen + "[[allow]]\npeer = \"ioc*\"\n",
       "7: peer \"ioc*\" cannot match: peers have names only with TLS, and no [[listen]] uses TLS"},
      {kServe + kListen + "[[allow]]\npeer = \"\"\n",
       "7: an empty pattern matches nothing; \"*\" matches everything"},
      {kServe + kListen + "[[allow]]\nservers = [\"a\", \"\"]\n",
       "7: an empty pattern matches nothing; \"*\" matches everything"},
  });
}

TEST_F(ConfigErrorTest, IncompleteTls) {
  const auto needs =
      ": TLS needs [tls] with certificate, key and authorities; or write security = \"plain\"";
  expectComplaints({
      {listenAt("*:9900"), std::string("3") + needs},
      {listenAt("*:9900") + "security = \"tls\"\n", std::string("5") + needs},
      {remoteAt("ioc1:9900"), std::string("1") + needs},
      {remoteAt("10.0.0.7:9900"),
       "3: 10.0.0.7 is an IP address, and a certificate has a name; write tls-name, too: the name "
       "in "
       "the certificate of that router"},
      {remoteAt("10.0.0.7:9900") + "tls-name = \"10.0.0.7\"\n",
       "4: tls-name 10.0.0.7 is an IP address; write a name"},
      {kRemote + "tls-name = \"a\"\n", "5: tls-name has no effect without TLS; remove it"},
  });
}

TEST_F(ConfigErrorTest, InvalidTlsFiles) {
  const auto tls = [](const std::string& certificate, const std::string& key,
                      const std::string& authorities) {
    return "[tls]\ncertificate = \"" + certificate + "\"\nkey = \"" + key + "\"\nauthorities = \"" +
           authorities + "\"\n" + remoteAt("ioc1:9900");
  };
  folder_.write("text", "hello\n");
  const Certificates authority(folder_, "all");
  const auto files = authority.files("ioc1", Valid::now);
  const auto old = authority.files("ioc1", Valid::notAnyMore);
  const auto good = withoutFolder(files.certificate);
  const auto key = withoutFolder(files.key);

  expectComplaints({
      {tls("missing.pem", key, good), "2: missing.pem cannot be read: No such file or directory"},
      {tls(good, "missing.key", good), "3: missing.key cannot be read: No such file or directory"},
      {tls(good, key, "."), "4: . cannot be read: Is a directory"},
      {tls("text", key, good),
       "2: text holds no certificate in PEM form: no line -----BEGIN CERTIFICATE-----"},
      {tls(good, good, good),
       "3: " + good + " holds no private key in PEM form: no line -----BEGIN PRIVATE KEY-----"},
      {tls(good, key, key),
       "4: " + key + " holds no certificate in PEM form: no line -----BEGIN CERTIFICATE-----"},
      {tls(withoutFolder(old.certificate), withoutFolder(old.key), good),
       "2: " + withoutFolder(old.certificate) + " expired on 2021-02-03 04:05 UTC; renew it"},
  });
}

TEST_F(ConfigErrorTest, UnreadableFiles) {
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
