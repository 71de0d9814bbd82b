// SPDX-License-Identifier: MIT
// Listener: TLS handshakes, and connections that never finish theirs.
#include "router/transport/listener.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <capnp/serialize.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kj/debug.h>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "router/transport/kj_text.h"
#include "tests/router/certificates.h"
#include "tests/router/frames.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

using testing::HasSubstr;

constexpr int kIdlers = 300;

// Connects from the address `from` of this host.
FileDescriptor connectTo(std::uint16_t port, std::uint32_t from = INADDR_LOOPBACK) {
  FileDescriptor caller(checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(from);
  checkCall(::bind(caller.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), "bind");
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  checkCall(::connect(caller.get(), reinterpret_cast<sockaddr*>(&address), sizeof address),
            "connect");
  return caller;
}

bool hasClosed(const FileDescriptor& peerOf) {
  char byte = 0;
  return ::recv(peerOf.get(), &byte, 1, MSG_DONTWAIT) == 0 || errno == ECONNRESET;
}

// A listener for TLS, and callers in the same thread.
class ListenerTest : public testing::Test {
 public:
  ~ListenerTest() noexcept override = default;

 protected:
  void listen() {
    listener_.start().wait(io_.waitScope);
    port_ = listener_.address().port;
  }
  // Connects without a handshake.
  kj::Own<kj::AsyncIoStream> begin() {
    return network()
        .parseAddress("127.0.0.1", port_)
        .wait(io_.waitScope)
        ->connect()
        .wait(io_.waitScope);
  }
  // Does its handshake, and returns the name by which the listener knows it. Throws kj::Exception
  // when the listener closes the connection: with TLS 1.3 that may be after the caller's last step.
  std::string finish(kj::Own<kj::AsyncIoStream> stream) {
    auto called = kj::newPromiseAndFulfiller<std::string>();
    called_ = kj::mv(called.fulfiller);
    Tls tls(ours_.files("honest"), io_.provider->getTimer(), context_.config.limits.handshakeTime);
    auto connected = tls.connect({kj::mv(stream), kj::UnknownPeerIdentity::newInstance()}, "server")
                         .wait(io_.waitScope);
    auto closed = connected.stream->tryRead(&unread_, 1, 1).then([](std::size_t) -> std::string {
      kj::throwFatalException(KJ_EXCEPTION(DISCONNECTED, "the listener closed the connection"));
    });
    return called.promise.exclusiveJoin(kj::mv(closed)).wait(io_.waitScope);
  }
  std::string call() { return finish(begin()); }
  bool tryCall() try { return call() == "honest"; } catch (const kj::Exception&) {
    return false;
  }
  // Runs the event loop until `condition` is true.
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
  }
  static RouterConfig withLongHandshakeTime() {
    RouterConfig config;
    config.limits.handshakeTime = std::chrono::hours(1);
    return config;
  }
  kj::Network& network() { return io_.provider->getNetwork(); }

  const mpf::test::Watchdog watchdog_{"listener test"};
  char unread_ = 0;
  const mpf::test::TemporaryFolder folder_;
  const mpf::test::TestBackplane backplane_;
  const Certificates ours_{folder_, "ours"};
  std::string said_;
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  Statistics statistics_{backplane_, "test"};
  ServerMonitors monitors_{backplane_, io_.unixEventPort, [] {}};
  RouterContext context_{
      .port = io_.unixEventPort,
      .network = io_.provider->getNetwork(),
      .timer = io_.provider->getTimer(),
      .backplane = backplane_,
      .log = Log([this](Log::Level, const std::string& text) { said_ += text + '\n'; }),
      .statistics = statistics_,
      .monitors = monitors_,
      .config = withLongHandshakeTime(),
      .tls = std::make_shared<Tls>(ours_.files("server"), io_.provider->getTimer(),
                                   withLongHandshakeTime().limits.handshakeTime)};
  kj::Own<kj::PromiseFulfiller<std::string>> called_;
  Listener listener_{
      context_,
      {.address = parseAddress("127.0.0.1:0"), .security = Security::tls},
      [this](const Listener::Caller& caller) { called_->fulfill(std::string(caller.name)); }};
  std::uint16_t port_ = 0;
};

TEST_F(ListenerTest, ClosesTheOldestOfTooManyHandshakes) {
  listen();
  std::vector<FileDescriptor> idlers;
  for (int i = 0; i < kIdlers; ++i) idlers.push_back(connectTo(port_));

  EXPECT_EQ(call(), "honest");

  EXPECT_TRUE(hasClosed(idlers.front()));
  EXPECT_FALSE(hasClosed(idlers.back()));
}

// Even when another host begins many handshakes.
TEST_F(ListenerTest, KeepsTheHandshakeOfAHostWithFew) {
  listen();
  auto slow = begin();
  std::vector<FileDescriptor> idlers;
  for (int i = 0; i < kIdlers; ++i) idlers.push_back(connectTo(port_, INADDR_LOOPBACK + 1));
  runUntil([&] { return hasClosed(idlers.front()); });

  EXPECT_EQ(finish(kj::mv(slow)), "honest");
}

// Some peers send nothing; others begin a handshake and stop.
TEST_F(ListenerTest, ClosesHandshakesThatTakeTooLongWhileOthersConnect) {
  context_.config.limits.handshakeTime = std::chrono::milliseconds(500);
  listen();
  std::vector<FileDescriptor> idlers;
  for (int i = 0; i < kIdlers; ++i) {
    idlers.push_back(connectTo(port_));
    if (i % 2 == 0) {
      EXPECT_EQ(::send(idlers.back().get(), "\x16\x03\x01", 3, MSG_NOSIGNAL), 3);
    }
  }

  while (!tryCall()) {  // on a busy host this handshake may take too long as well
  }
  for (const auto& idler : idlers) runUntil([&] { return hasClosed(idler); });
  EXPECT_THAT(said_, HasSubstr("did not finish the TLS handshake in time (handshake-time)"));
}

TEST_F(ListenerTest, SendsAFarewellToAPeerThatUsesPlainTcp) {
  listen();
  const auto caller = connectTo(port_);
  const auto bytes = mpf::test::frameOf({mpf::test::greeting()});
  ASSERT_EQ(::send(caller.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(bytes.size()));
  runUntil([&] { return said_.find("plain TCP") != std::string::npos; });

  capnp::StreamFdMessageReader frame(caller.get());
  const auto items = frame.getRoot<wire::Frame>().getItems();

  ASSERT_EQ(items.size(), 1u);
  ASSERT_TRUE(items[0].isFarewell());
  EXPECT_THAT(toStd(items[0].getFarewell().getReason()),
              HasSubstr("this port expects TLS: write security = \"tls\""));
  EXPECT_THAT(said_, HasSubstr("the peer uses plain TCP, and this port expects TLS"));
  ::shutdown(caller.get(), SHUT_WR);
  runUntil([&] { return hasClosed(caller); });
}

TEST_F(ListenerTest, ClosesConnectionsOfOtherProtocols) {
  listen();
  const auto caller = connectTo(port_);
  ASSERT_EQ(::send(caller.get(), "GET / HTTP/1.1\r\n\r\n", 18, MSG_NOSIGNAL), 18);

  runUntil([&] { return said_.find("the peer does not use TLS") != std::string::npos; });

  char byte = 0;
  EXPECT_LE(::recv(caller.get(), &byte, 1, 0), 1) << "an alert, or the end";
  EXPECT_EQ(call(), "honest");
}

}  // namespace
}  // namespace mpf::router::test
