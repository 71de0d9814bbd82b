// SPDX-License-Identifier: MIT
// completeConfig(): values that are valid by themselves, but do not fit together.
#include "tests/router/certificates.h"
#include "tests/router/config/config_fixture.h"

// Lines of TOML end with \n here, so that one test case is one line.
// NOLINTBEGIN(modernize-raw-string-literal)
namespace mpf::router::test {
namespace {

const std::string kListen = "[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n";

std::string listenAt(const std::string& address) {
  return kServe + "[[listen]]\naddress = \"" + address + "\"\n";
}
std::string remoteAt(const std::string& address) {
  return "[[remote]]\nlocations = [2]\naddress = \"" + address + "\"\n";
}

using CompleteConfigTest = ConfigTest;

TEST_F(CompleteConfigTest, TlsFilesAreNotReadWhenNoConnectionUsesTls) {
  EXPECT_EQ(
      complaintOf(std::string("[tls]\ncertificate = \"a\"\nkey = \"b\"\nauthorities = \"c\"\n") +
                  kRemote),
      "nothing");
}

TEST_F(CompleteConfigTest, PlainTcpIsAllowedWithAddressesThatAreNotPublic) {
  for (const std::string address :
       {"127.0.0.1:0", "10.1.2.3:1", "172.31.0.1:1", "192.168.0.1:1", "169.254.1.1:1", "[::1]:1",
        "[fd00::7]:1", "[fe80::1]:1", "localhost:1"}) {
    EXPECT_EQ(complaintOf("[[serve]]\nlocation=1\n[[listen]]\naddress = \"" + address +
                          "\"\nsecurity = \"plain\"\n"),
              "nothing")
        << address;
  }
}

TEST_F(CompleteConfigTest, SeveralListenersMayHavePort0) {
  EXPECT_EQ(
      complaintOf("[[serve]]\nlocation=1\n" +
                  std::string("[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n") +
                  "[[listen]]\naddress = \"127.0.0.1:0\"\nsecurity = \"plain\"\n"),
      "nothing");
}

TEST_F(CompleteConfigTest, InvalidValues) {
  expectComplaints({
      {"group = \"root\"\n" + kRemote,
       "1: the mode gives this group no access; write mode 0660, too"},
      {"log-level = \"loud\"\n" + kRemote,
       "1: log-level \"loud\": use trace, debug, info, warning, error, critical, off"},
      {"\nname = \"a\\tb\"\n" + kRemote, "2: name \"a\\tb\": use 1 to 63 printable characters"},
      {"backplane = \"a.b\"\n" + kRemote,
       "1: backplane name \"a.b\": use 1 to 39 of the characters A-Z a-z 0-9 _ -"},
      {"[limits]\nfirst-retry = \"9s\"\n" + kRemote,
       "2: first-retry, 9000 ms, is longer than last-retry, 5000 ms"},
  });
}

TEST_F(CompleteConfigTest, ARouterWithNothingToDo) {
  expectComplaints({
      {"",
       "1: nothing to do: write [[serve]] and [[listen]] to offer servers of this host to other "
       "hosts, or [[remote]] to reach servers of other hosts"},
      {"\n" + kServe, "2: no client can reach the served locations; write [[listen]], too"},
      {kListen, "1: this router listens, but serves no location; write [[serve]], too"},
      {kRemote + "[[allow]]\n", "5: [[allow]] without [[serve]]: there is nothing to allow"},
  });
}

TEST_F(CompleteConfigTest, DuplicateLocationsAndAddresses) {
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

TEST_F(CompleteConfigTest, AddressesThatCannotBeConnectedTo) {
  expectComplaints({
      {remoteAt("*:9900"),
       "3: *:9900 is a wildcard address to listen on; write the address of one host"},
      {remoteAt("[::]:9900"),
       "3: [::]:9900 is a wildcard address to listen on; write the address of one host"},
      {remoteAt("ioc1:0"), "3: ioc1:0: the port must be 1 to 65535"},
  });
}

TEST_F(CompleteConfigTest, PlainTcpWithPublicAddresses) {
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

TEST_F(CompleteConfigTest, Patterns) {
  expectComplaints({
      {kServe + kListen + "[[allow]]\npeer = \"ioc*\"\n",
       "7: peer \"ioc*\" cannot match: peers have names only with TLS, and no [[listen]] uses TLS"},
      {kServe + kListen + "[[allow]]\npeer = \"\"\n",
       "7: an empty pattern matches nothing; \"*\" matches everything"},
      {kServe + kListen + "[[allow]]\nservers = [\"a\", \"\"]\n",
       "7: an empty pattern matches nothing; \"*\" matches everything"},
  });
}

TEST_F(CompleteConfigTest, IncompleteTls) {
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

TEST_F(CompleteConfigTest, InvalidTlsFiles) {
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

}  // namespace
}  // namespace mpf::router::test
// NOLINTEND(modernize-raw-string-literal)
