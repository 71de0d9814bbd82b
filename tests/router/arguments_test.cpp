// SPDX-License-Identifier: MIT
// The command line of mpf-router: a file, options that replace a file, and options that override a
// file.
#include "router/arguments.h"

#include "tests/router/certificates.h"
#include "tests/router/config/config_fixture.h"

namespace mpf::router::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

struct Started {
  std::optional<int> status;
  std::string out;
  std::string err;
};

class ArgumentsTest : public ConfigTest {
 protected:
  Started start(const std::vector<std::string>& words) {
    std::vector<const char*> argv{"mpf-router"};
    for (const auto& word : words) argv.push_back(word.c_str());
    arguments_ = std::make_unique<RouterArguments>();
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Started started;
    started.status = arguments_->start(static_cast<int>(argv.size()), argv.data());
    started.err = withoutFolder(testing::internal::GetCapturedStderr());
    started.out = withoutFolder(testing::internal::GetCapturedStdout());
    return started;
  }
  [[nodiscard]] const RouterConfig& config() const { return arguments_->config(); }

  std::unique_ptr<RouterArguments> arguments_;
};

TEST_F(ArgumentsTest, ConfigureASimpleServerRouter) {
  const auto started = start({"--serve", "1=0", "--serve", "3", "--listen", "127.0.0.1:9900",
                              "--listen", "[::1]:9900", "--plain"});

  EXPECT_EQ(started.status, std::nullopt) << started.err;
  EXPECT_THAT(config().serve, ElementsAre(Serve{1, 0}, Serve{3, 3}));
  EXPECT_THAT(config().listen, ElementsAre(Listen{{"127.0.0.1", 9900}, Security::plain},
                                           Listen{{"::1", 9900}, Security::plain}));
  EXPECT_EQ(config().limits, Limits());
}

TEST_F(ArgumentsTest, ConfigureASimpleClientRouter) {
  const auto tls = Certificates(folder_, "lab").files("ioc1");

  const auto started = start({"--remote",
                              "1,-2=10.0.0.7:9900",
                              "--tls-name",
                              "ioc1",
                              "--tls-certificate",
                              tls.certificate,
                              "--tls-key",
                              tls.key,
                              "--tls-authorities",
                              tls.authorities,
                              "--name",
                              "me",
                              "--backplane",
                              "b",
                              "--mode",
                              "0666",
                              "--log-level",
                              "debug",
                              "--queue-size",
                              "40",
                              "--buffer-size",
                              "1500",
                              "--dead-time",
                              "5",
                              "--handshake-time",
                              "0.1min"});

  EXPECT_EQ(started.status, std::nullopt) << started.err;
  EXPECT_THAT(config().remotes,
              ElementsAre(Remote{{1, -2}, {"10.0.0.7", 9900}, Security::tls, "ioc1"}));
  EXPECT_EQ(config().tls, tls);
  EXPECT_EQ(config().name, "me");
  EXPECT_EQ(config().backplane, "b");
  EXPECT_EQ(config().rights.mode, 0666U);
  EXPECT_EQ(config().logLevel, "debug");
  EXPECT_EQ(config().limits.queueSize, 40U);
  EXPECT_EQ(config().limits.bufferBytes, 1500U);
  EXPECT_EQ(config().limits.deadTime, 5s) << "without a unit";
  EXPECT_EQ(config().limits.handshakeTime, 6s);
}

TEST_F(ArgumentsTest, OverrideTheFile) {
  const auto file = folder_.write(
      "r.toml",
      "name = \"file\"\nbackplane = \"file\"\n[limits]\nqueue-size = 7\nmax-clients = 8\n"
      "[[remote]]\nlocations = 1\naddress = \"a:1\"\nsecurity = \"plain\"\n");

  const auto started = start({"--name", "option", file, "--queue-size", "9"});

  EXPECT_EQ(started.status, std::nullopt) << started.err;
  EXPECT_EQ(config().name, "option");
  EXPECT_EQ(config().backplane, "file");
  EXPECT_EQ(config().limits.queueSize, 9U);
  EXPECT_EQ(config().limits.maxClients, 8U);
}

TEST_F(ArgumentsTest, OverrideTheFileAgainAfterAReload) {
  const std::string remote = "[[remote]]\nlocations = 1\naddress = \"a:1\"\nsecurity = \"plain\"\n";
  const auto file = folder_.write("r.toml", remote);
  ASSERT_EQ(start({file, "--name", "option"}).status, std::nullopt);
  folder_.write("r.toml", "name = \"file\"\nbackplane = \"changed\"\n" + remote);

  const auto changed = arguments_->loadConfig();

  EXPECT_EQ(changed.name, "option");
  EXPECT_EQ(changed.backplane, "changed");
  EXPECT_EQ(config().backplane, "") << "the loaded configuration does not change";
  folder_.write("r.toml", "nam = 1\n" + remote);
  EXPECT_THROW(static_cast<void>(arguments_->loadConfig()), ConfigError);
}

TEST_F(ArgumentsTest, AreNamedInErrors) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{},
       "nothing to do: write --serve and --listen to offer servers of this host to other hosts, or "
       "--remote to reach servers of other hosts"},
      {{"--serve", "1"},
       "--serve 1: no client can reach the served locations; write --listen, too"},
      {{"--serve", "one"}, "--serve: \"one\" is not a location: write an integer"},
      {{"--serve", "1="}, "--serve: \"\" is not a location: write an integer"},
      {{"--remote", "ioc1:9900"}, "--remote: \"ioc1:9900\": write LOCATION[,LOCATION]=HOST:PORT"},
      {{"--remote", "1,=ioc1:9900"}, "--remote: \"\" is not a location: write an integer"},
      {{"--remote", "=127.0.0.1:5"}, "--remote: \"\" is not a location: write an integer"},
      {{"--ready-fd", "99"}, "--ready-fd: 99: not a descriptor that is open for writing"},
      {{"--ready-fd=-1"}, "--ready-fd: -1: not a descriptor that is open for writing"},
      {{"--remote", "1=ioc1"},
       "--remote: \"ioc1\" has no port; write HOST:PORT, such as ioc1.lab:9900, 10.0.0.7:9900, "
       "[fd00::7]:9900 or, to listen, *:9900"},
      {{"--remote", "1=a:1", "--remote", "1=b:1", "--plain"},
       "--remote 1=b:1: location 1 appears twice in remotes; write it once"},
      {{"--remote", "1=a:1"},
       "--remote 1=a:1: TLS needs --tls-certificate, --tls-key and --tls-authorities; or add "
       "--plain"},
      {{"--remote", "1=10.0.0.7:1"},
       "--remote 1=10.0.0.7:1: 10.0.0.7 is an IP address, and a certificate has a name; write "
       "--tls-name, too: the name in the certificate of that router"},
      {{"--remote", "1=a:1", "--remote", "2=b:1", "--tls-name", "x"},
       "--tls-name: it applies to a single --remote; for several, write a configuration file"},
      {{"--serve", "1", "--listen", "*:1", "--plain"},
       "--listen *:1: plain TCP at *:1, which is every network of this host: use TLS, or a "
       "loopback, private or link-local address, or write --allow-public-plain"},
      {{"--queue-size", "0"}, "--queue-size: 0 is out of range: use 1 to 1000000"},
      {{"--dead-time", "soon"},
       "--dead-time: \"soon\": write a time with its unit, such as 500ms, 2s or 1min"},
      {{"--mode", "7"}, "--mode: 7: use an octal number between 0600 and 0666, such as 0660"},
      {{"--group", "no-such-group"}, "--group: no-such-group: there is no group of this name"},
      {{"--group", "root"}, "--group: the mode gives this group no access; write mode 0660, too"},
      {{"--remote", "1=a:1", "--plain", "--log-level", "loud"},
       "--log-level: log-level \"loud\": use trace, debug, info, warning, error, critical, off"},
      {{"--remote", "1=a:1", "--plain", "--backplane", "a.b"},
       "--backplane: backplane name \"a.b\": use 1 to 39 of the characters A-Z a-z 0-9 _ -"},
      {{"--remote", "1=a:1", "--tls-certificate", folder_.file("none"), "--tls-key", "k",
        "--tls-authorities", "a"},
       "--tls-certificate: none cannot be read: No such file or directory"},
  };
  for (const auto& [words, why] : wrong) {
    const auto started = start(words);

    EXPECT_EQ(started.status, 2);
    EXPECT_EQ(started.err, "mpf-router: " + why + "; `mpf-router --help` shows how to use it\n");
    EXPECT_THAT(started.out, IsEmpty());
  }
}

TEST_F(ArgumentsTest, ErrorsOfAFileNameItsLine) {
  const auto started = start({folder_.write("r.toml", "\nnam = \"a\"\n")});

  EXPECT_EQ(started.status, 2);
  EXPECT_EQ(started.err, "mpf-router: r.toml:2:1: unknown key \"nam\"; did you mean \"name\"?\n");
}

TEST_F(ArgumentsTest, SomeCannotBeCombinedWithAFile) {
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"--serve", "1", "r.toml"}, {"--plain", "r.toml"}, {"r.toml", "--tls-name", "a"}}) {
    const auto& option = words[0] == "r.toml" ? words[1] : words[0];
    EXPECT_EQ(start(words).err,
              "mpf-router: " + option +
                  ": it cannot be combined with a configuration file; write it into r.toml\n");
  }
}

TEST_F(ArgumentsTest, CheckDescribesTheConfiguration) {
  const auto tls = Certificates(folder_, "lab").files("ioc1");
  const auto file = folder_.write(
      "r.toml", "name = \"ioc1\"\nbackplane = \"b\"\nmode = \"0666\"\n[tls]\ncertificate = \"" +
                    tls.certificate + "\"\nkey = \"" + tls.key + "\"\nauthorities = \"" +
                    tls.authorities + R"("
[[serve]]
location = 1
local = 0
[[serve]]
location = 3
[[listen]]
address = "*:9900"
[[listen]]
address = "10.0.0.1:9901"
security = "plain"
[[allow]]
peer = "ioc*"
servers = ["serial*", "dac"]
locations = [1, 3]
[[allow]]
servers = "Int32"
[[remote]]
locations = [5, 6]
address = "ioc5:9900"
[[remote]]
locations = 7
address = "[fd00::7]:9900"
security = "plain"
)");

  const auto started = start({file, "--check"});

  EXPECT_EQ(started.status, 0) << started.err;
  EXPECT_THAT(started.err, IsEmpty());
  EXPECT_THAT(started.out,
              StartsWith("router      ioc1, on backplane b, clients of this host: mode 0666\n"
                         "serves      location 1 (here 0), 3\n"
                         "listens     *:9900, TLS\n"
                         "listens     10.0.0.1:9901, plain TCP\n"
                         "allows      ioc* to bind to serial*, dac at location 1, 3\n"
                         "allows      * to bind to Int32 at all locations\n"
                         "connects    ioc5:9900, TLS, certificate of ioc5, for locations 5, 6\n"
                         "connects    [fd00::7]:9900, plain TCP, for location 7\n"
                         "certificate ioc1, valid until 20"));
  EXPECT_THAT(
      started.out,
      HasSubstr(
          "\nlimits      queue-size 256 buffer-size 1MiB max-message-size 64MiB window-size 4MiB "
          "max-clients 16000 "
          "max-connections 1000 dead-time 2s handshake-time 5s first-retry 100ms last-retry 5s\n"));
}

TEST_F(ArgumentsTest, WarnsOfARemoteAtTheLocationOfThisHost) {
  const auto warned = start({"--remote", "0=127.0.0.1:9900", "--plain", "--check"});
  const auto usual = start({"--remote", "1=127.0.0.1:9900", "--plain", "--check"});

  EXPECT_EQ(warned.status, 0);
  EXPECT_THAT(warned.err,
              HasSubstr("mpf-router: warning: location 0 of the remote 127.0.0.1:9900"));
  EXPECT_THAT(usual.err, IsEmpty());
}

}  // namespace
}  // namespace mpf::router::test
