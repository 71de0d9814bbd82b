// SPDX-License-Identifier: MIT
// Tls: both ends of a connection, with valid and with invalid certificates.
#include "router/transport/tls.h"

#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <optional>
#include <stdexcept>
#include <string>

#include "tests/router/certificates.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const std::string kNotOurs = "the peer's certificate was not signed by one of our authorities";

const std::string kNoTls =
    "the peer does not use TLS: set the same security, \"tls\" or \"plain\", at both routers";

class TlsTest : public testing::Test {
 public:
  ~TlsTest() noexcept override = default;  // kj's destructors may throw

 protected:
  // The result of the handshake on one side.
  struct Side {
    kj::Maybe<kj::AuthenticatedStream> connected;
    std::string problem;  // of the handshake or, on the client side, of the first read
  };
  struct Sides {
    Side server, client;
  };
  using Handshake = kj::Promise<kj::AuthenticatedStream>;

  kj::AuthenticatedStream anonymous(kj::Own<kj::AsyncIoStream> stream) {
    return {kj::mv(stream), kj::UnknownPeerIdentity::newInstance()};
  }

  // Does the handshake on both sides.
  Sides shakeHands(Tls& server, Tls& client, const std::string& name) {
    auto pipe = io_.provider->newTwoWayPipe();
    Sides sides;
    auto accepted = watch(server.accept(anonymous(kj::mv(pipe.ends[0]))), sides.server);
    auto connected =
        watch(client.connect(anonymous(kj::mv(pipe.ends[1])), name), sides.client, name);
    accepted.wait(io_.waitScope);
    connected.wait(io_.waitScope);
    return sides;
  }
  // Closes the connection when its handshake fails, as a router does.
  kj::Promise<void> watch(Handshake handshake, Side& side, const std::string& name = {}) {
    return handshake
        .then([&](kj::AuthenticatedStream stream) { side.connected = kj::mv(stream); },
              [&side, name](kj::Exception&& error) { side.problem = tlsProblem(error, name); })
        .eagerlyEvaluate(nullptr);
  }
  static kj::AuthenticatedStream& streamOf(Side& side) {
    KJ_IF_MAYBE (stream, side.connected) return *stream;
    throw std::runtime_error("the handshake failed: " + side.problem);
  }
  static std::string nameOf(Side& side) { return peerName(*streamOf(side).peerIdentity); }
  // Why the first read of the client side fails, after a successful connect().
  std::string problemOfRead(Side& side) {
    char byte = 0;
    std::string problem = "nothing";
    streamOf(side)
        .stream->tryRead(&byte, 1, 1)
        .then([&](std::size_t length) { problem = length == 0 ? "end" : "a byte"; },
              [&](kj::Exception&& error) { problem = tlsProblem(error); })
        .wait(io_.waitScope);
    return problem;
  }
  // Why the handshake fails on a server side that receives these bytes.
  std::string problemOfAccepting(kj::StringPtr bytes) {
    Tls server(ours_.files("server"), io_.provider->getTimer(), 1h);
    auto pipe = io_.provider->newTwoWayPipe();
    Side side;
    auto accepted = watch(server.accept(anonymous(kj::mv(pipe.ends[0]))), side);
    pipe.ends[1]->write(bytes.begin(), bytes.size()).wait(io_.waitScope);
    pipe.ends[1]->shutdownWrite();
    accepted.wait(io_.waitScope);
    EXPECT_EQ(side.connected, nullptr);
    return side.problem;
  }
  std::unique_ptr<Tls> tls(const TlsFiles& files) {
    return std::make_unique<Tls>(files, io_.provider->getTimer(), 1h);
  }

  mpf::test::Watchdog watchdog_{"TLS test"};
  mpf::test::TemporaryFolder folder_;
  Certificates ours_{folder_, "ours"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
};

TEST_F(TlsTest, CarriesBytesBothWaysAndShowsThePeersNames) {
  auto sides =
      shakeHands(*tls(ours_.files("server.lab")), *tls(ours_.files("client.lab")), "server.lab");

  EXPECT_EQ(nameOf(sides.server), "client.lab");
  EXPECT_EQ(nameOf(sides.client), "server.lab");
  for (auto* const from : {&sides.server, &sides.client}) {
    auto* const to = from == &sides.server ? &sides.client : &sides.server;
    std::array<char, 5> bytes{};
    auto written = streamOf(*from).stream->write("hello", 5);
    streamOf(*to).stream->read(bytes.data(), 5).wait(io_.waitScope);
    written.wait(io_.waitScope);
    EXPECT_EQ(std::string_view(bytes.data(), 5), "hello");
  }
}

TEST_F(TlsTest, RefusesAClientOfAnotherAuthority) {
  const Certificates theirs(folder_, "theirs");
  auto stranger = theirs.files("client");
  stranger.authorities = ours_.authorities();

  auto sides = shakeHands(*tls(ours_.files("server")), *tls(stranger), "server");

  EXPECT_EQ(sides.server.problem, kNotOurs + ", or is not valid now");
  EXPECT_EQ(problemOfRead(sides.client),
            "the peer refused our certificate: its authorities did not sign it");
}

TEST_F(TlsTest, DoesNotTrustTheAuthoritiesOfTheHost) {
  const Certificates hosts(folder_, "hosts");
  ::setenv("SSL_CERT_FILE", hosts.authorities().c_str(), 1);
  auto stranger = hosts.files("client");
  stranger.authorities = ours_.authorities();

  auto sides = shakeHands(*tls(ours_.files("server")), *tls(stranger), "server");

  ::unsetenv("SSL_CERT_FILE");
  EXPECT_EQ(sides.server.problem, kNotOurs + ", or is not valid now");
}

TEST_F(TlsTest, RefusesAServerOfAnotherAuthority) {
  const Certificates theirs(folder_, "theirs");
  auto stranger = theirs.files("server");
  stranger.authorities = ours_.authorities();

  EXPECT_EQ(shakeHands(*tls(stranger), *tls(ours_.files("client")), "server").client.problem,
            kNotOurs);
}

// As during a change of authorities: the file contains the old one and the new one.
TEST_F(TlsTest, TrustsEachOfItsAuthorities) {
  const Certificates theirs(folder_, "theirs");
  auto server = ours_.files("server");
  server.authorities = folder_.file("both.pem");
  std::ofstream(server.authorities)
      << std::ifstream(ours_.authorities()).rdbuf() << std::ifstream(theirs.authorities()).rdbuf();
  auto client = theirs.files("client");
  client.authorities = ours_.authorities();

  auto sides = shakeHands(*tls(server), *tls(client), "server");

  EXPECT_EQ(nameOf(sides.server), "client");
}

TEST_F(TlsTest, RefusesCertificatesThatAreNotValidNow) {
  auto server = tls(ours_.files("server"));
  auto client = tls(ours_.files("client"));

  EXPECT_EQ(
      shakeHands(*tls(ours_.files("server", Valid::notAnyMore)), *client, "server").client.problem,
      "the peer's certificate has expired");
  EXPECT_EQ(
      shakeHands(*tls(ours_.files("server", Valid::notYet)), *client, "server").client.problem,
      "the peer's certificate is not valid yet");
  auto sides = shakeHands(*server, *tls(ours_.files("client", Valid::notAnyMore)), "server");
  EXPECT_EQ(sides.server.problem, kNotOurs + ", or is not valid now");
  EXPECT_EQ(problemOfRead(sides.client), "the peer refused our certificate: it has expired");
  EXPECT_EQ(
      shakeHands(*server, *tls(ours_.files("client", Valid::notYet)), "server").server.problem,
      kNotOurs + ", or is not valid now");
}

TEST_F(TlsTest, RefusesAServerOfAnotherName) {
  auto sides = shakeHands(*tls(ours_.files("server")), *tls(ours_.files("client")), "other");

  EXPECT_EQ(sides.client.problem,
            "the peer's certificate is for another name, not for \"other\" (tls-name)");
}

TEST_F(TlsTest, RefusesAClientWithoutCertificate) {
  Tls server(ours_.files("server"), io_.provider->getTimer(), 1h);
  kj::TlsContext::Options options;
  options.useSystemTrustStore = true;
  kj::TlsContext stranger(options);
  auto pipe = io_.provider->newTwoWayPipe();
  Sides sides;
  auto accepted = watch(server.accept(anonymous(kj::mv(pipe.ends[0]))), sides.server);

  auto connected =
      watch(stranger.wrapClient(anonymous(kj::mv(pipe.ends[1])), "server"), sides.client);

  connected.wait(io_.waitScope);
  EXPECT_THAT(sides.client.problem, HasSubstr("was not signed"))
      << "the client does not trust our authority, either";
  accepted.wait(io_.waitScope);
  EXPECT_EQ(sides.server.problem, "the peer sent no certificate");
}

TEST_F(TlsTest, RefusesOtherProtocols) {
  EXPECT_EQ(problemOfAccepting("GET / HTTP/1.1\r\n\r\n"), kNoTls);
  EXPECT_EQ(problemOfAccepting("hello, hello, hello\n"), kNoTls);
  const std::string frame("\0\0\0\0\x09\0\0\0\0\0\0\0\x01\0\0\0",
                          16);  // as a router on plain TCP begins
  EXPECT_EQ(problemOfAccepting(kj::StringPtr(frame.c_str(), frame.size())), kNoTls);
}

TEST_F(TlsTest, ReportsAPeerThatClosesDuringTheHandshake) {
  EXPECT_EQ(problemOfAccepting(""), "the peer closed the connection during the TLS handshake");
  EXPECT_EQ(problemOfAccepting(kj::StringPtr("\x16\x03\x01", 3)),
            "the peer closed the connection during the TLS handshake");
}

// The client is another program, with this version and with the one before.
TEST_F(TlsTest, AcceptsOnlyTls13) {
  auto server = tls(ours_.files("server"));
  const auto client = ours_.files("client");
  auto port = io_.provider->getNetwork().parseAddress("127.0.0.1:0").wait(io_.waitScope)->listen();
  const auto tryWith = [&](const std::string& version) {
    const mpf::test::Program program({MPF_TEST_OPENSSL, "s_client", "-brief", version, "-connect",
                                      "127.0.0.1:" + std::to_string(port->getPort()), "-cert",
                                      client.certificate, "-key", client.key, "-CAfile",
                                      client.authorities});
    Side side;
    watch(server->accept(port->acceptAuthenticated().wait(io_.waitScope)), side)
        .wait(io_.waitScope);
    return side;
  };

  auto current = tryWith("-tls1_3");
  const auto older = tryWith("-tls1_2");

  EXPECT_EQ(nameOf(current), "client");
  EXPECT_EQ(older.problem, "the peer does not support TLS 1.3, the only version that routers use");
}

// The test sets the time.
TEST_F(TlsTest, LimitsTheTimeOfTheHandshake) {
  kj::TimerImpl timer(kj::origin<kj::TimePoint>());
  Tls tls(ours_.files("both"), timer, 3s);
  auto pipe = io_.provider->newTwoWayPipe();
  auto other = io_.provider->newTwoWayPipe();
  Sides sides;
  auto accepted = watch(tls.accept(anonymous(kj::mv(pipe.ends[0]))), sides.server);
  auto connected = watch(tls.connect(anonymous(kj::mv(other.ends[0])), "both"), sides.client);

  timer.advanceTo(kj::origin<kj::TimePoint>() + 2999 * kj::MILLISECONDS);
  EXPECT_FALSE(accepted.poll(io_.waitScope));
  EXPECT_FALSE(connected.poll(io_.waitScope));
  timer.advanceTo(kj::origin<kj::TimePoint>() + 3 * kj::SECONDS);

  accepted.wait(io_.waitScope);
  connected.wait(io_.waitScope);
  EXPECT_EQ(sides.server.problem,
            "the peer did not finish the TLS handshake in time (handshake-time)");
  EXPECT_EQ(sides.client.problem,
            "the peer did not finish the TLS handshake in time (handshake-time)");
}

// A reload replaces the Tls, and existing connections continue.
TEST_F(TlsTest, ConnectionsOutliveIt) {
  auto server = tls(ours_.files("server"));
  auto client = tls(ours_.files("client"));
  auto sides = shakeHands(*server, *client, "server");

  server.reset();
  client.reset();

  char byte = 0;
  auto written = streamOf(sides.server).stream->write("x", 1);
  streamOf(sides.client).stream->read(&byte, 1).wait(io_.waitScope);
  written.wait(io_.waitScope);
  EXPECT_EQ(byte, 'x');
  EXPECT_EQ(nameOf(sides.server), "client");
}

TEST_F(TlsTest, PlainTcpHasNoNames) {
  EXPECT_EQ(peerName(*kj::UnknownPeerIdentity::newInstance()), "");
}

}  // namespace
}  // namespace mpf::router::test
