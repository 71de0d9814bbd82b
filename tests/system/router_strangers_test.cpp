// SPDX-License-Identifier: MIT
// Routers and unusable peers: the wrong security, idle callers, floods of refused requests.
#include <fcntl.h>
#include <sys/stat.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/router/certificates.h"
#include "tests/router/rogue/rogue_peer.h"
#include "tests/support/log_lines.h"
#include "tests/support/router_pair.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class RouterStrangersTest : public testing::Test {
 protected:
  RouterPair::Options tls(const std::string& name) {
    const auto files = ours_.files(name);
    return {"--tls-certificate", files.certificate,   "--tls-key",
            files.key,           "--tls-authorities", files.authorities};
  }
  // Starts a router on the remote backplane that listens with this security.
  std::unique_ptr<RouterProcess> listen(const RouterPair::Options& security) {
    RouterPair::Options options{"--backplane", far_.name(), "--serve",
                                "1",           "--listen",  port_.address()};
    options.insert(options.end(), security.begin(), security.end());
    return std::make_unique<RouterProcess>(options);
  }
  std::unique_ptr<RouterProcess> call(const RouterPair::Options& security) {
    RouterPair::Options options{"--backplane", near_.name(), "--remote", "1=" + port_.address()};
    options.insert(options.end(), security.begin(), security.end());
    return std::make_unique<RouterProcess>(options);
  }

  const Watchdog watchdog_{"router strangers test"};
  const TemporaryFolder folder_;
  const router::test::Certificates ours_{folder_, "ours"};
  const TestBackplane near_;
  const TestBackplane far_;
  const FreePort port_;
};

TEST_F(RouterStrangersTest, ACallerInPlainTcpIsToldThatThePortExpectsTls) {
  const auto far = listen(tls("far"));

  const auto near = call({"--plain"});

  near->waitUntilSaid("this port expects TLS: write security = \"tls\" for this remote");
  far->waitUntilSaid("the peer uses plain TCP, and this port expects TLS");
}

TEST_F(RouterStrangersTest, ACallerWithTlsIsToldThatThePortIsPlain) {
  const auto far = listen({"--plain"});
  auto security = tls("near");
  security.insert(security.end(), {"--tls-name", "far"});

  const auto near = call(security);

  near->waitUntilSaid(
      "the peer does not use TLS: set the same security, \"tls\" or \"plain\", at both routers");
  far->waitUntilSaid(
      "the peer uses TLS, this side of the connection plain TCP: set the same security");
}

// More callers than the limit of connections, from the same host.
TEST_F(RouterStrangersTest, CallersThatDoNotGreetMakeRoomForAPeer) {
  const auto far = listen({"--plain", "--max-connections", "10"});
  std::vector<std::unique_ptr<RoguePeer>> idlers;
  for (int i = 0; i < 50; ++i) idlers.push_back(std::make_unique<RoguePeer>(port_.address()));

  const auto near = call({"--plain"});

  near->waitUntilSaid("connected to ");
  far->waitUntilSaid("without a greeting: closing the oldest of these");
}

TEST_F(RouterStrangersTest, ARefusedCallerIsToldWhy) {
  const auto far = listen({"--plain", "--max-connections", "1"});
  const auto near = call({"--plain"});
  far->waitUntilSaid(" is connected");

  RoguePeer third(port_.address());

  EXPECT_THAT(third.farewell(),
              HasSubstr("this router has 1 connections, its limit (max-connections)"));
}

// For ten thousand refused requests for servers, the log has few lines, which count all of them.
TEST_F(RouterStrangersTest, AFloodOfRefusedRequestsMakesAShortLog) {
  constexpr std::uint64_t kRequests = 10'000;
  constexpr std::uint32_t kAtOnce = 100;
  const auto far = listen({"--plain"});
  RoguePeer peer(port_.address());
  peer.sendItems({greeting()});
  for (std::uint64_t sent = 0; sent < kRequests; sent += kAtOnce) {
    std::vector<Fill> items;
    for (std::uint32_t i = 1; i <= kAtOnce; ++i) {
      items.emplace_back([i](wire::Item::Builder item) {
        auto bind = item.initBind();
        bind.setBinding(i);
        bind.setLocation(4711);
        bind.setServer("server");
      });
    }
    ASSERT_TRUE(peer.sendItems(items));
    for (std::uint32_t i = 0; i < kAtOnce; ++i) {
      EXPECT_EQ(peer.next(wire::Item::SERVER).getServer().getState(), wire::Server::State::REFUSED);
    }
  }

  EXPECT_EQ(far->end(SIGTERM), 0);

  const auto count = countLines(far->said(), "location 4711");
  EXPECT_EQ(count.meant, kRequests) << far->said();
  EXPECT_LT(count.all, 100u);
}

class RouterSlowNameTest : public RouterStrangersTest {
 protected:
  RouterSlowNameTest() {
    checkCall(::mkfifo(fifo_.c_str(), 0600), "mkfifo", fifo_);
    ::setenv("LD_PRELOAD", MPF_TEST_HELD_LOOKUP, 1);
    ::setenv("MPF_TEST_HELD_LOOKUP", fifo_.c_str(), 1);
  }
  ~RouterSlowNameTest() override {
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("MPF_TEST_HELD_LOOKUP");
  }
  // Writes the configuration of the router.
  void writeFile(const std::string& address) const {
    folder_.write("router.toml",
                  fmt::format("backplane = \"{}\"\nallow-public-plain = true\n"
                              "[limits]\ndead-time = \"100ms\"\n"
                              "[[remote]]\nlocations = 1\naddress = \"{}\"\nsecurity = \"plain\"\n",
                              near_.name(), address));
  }
  // A router whose look-up of its remote has taken too long, but not ended.
  [[nodiscard]] std::unique_ptr<RouterProcess> startRouter() const {
    writeFile("localhost.held:9");
    auto router = std::make_unique<RouterProcess>(
        std::vector<std::string>{folder_.file("router.toml"), "--log-level", "debug"});
    router->waitUntilSaid(
        "cannot reach localhost.held:9: the look-up of localhost.held took longer than 100ms "
        "(dead-time)");
    return router;
  }
  // Lets the look-up find its name. The descriptor keeps the FIFO open.
  [[nodiscard]] FileDescriptor endLookUp() const {
    FileDescriptor lookUp(
        checkCall(::open(fifo_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC), "open", fifo_));
    checkCall(::write(lookUp.get(), "x", 1), "write", fifo_);
    return lookUp;
  }

  const std::string fifo_ = folder_.file("lookup");
};

TEST_F(RouterSlowNameTest, ALookUpThatTakesTooLongIsUsedWhenItEnds) {
  const auto router = startRouter();

  const auto lookUp = endLookUp();

  router->waitUntilSaid("cannot reach localhost.held:9: the connection to");
}

// The look-up continues in its thread, and its result is ignored. The router removes the old remote
// in the turns of its event loop after the reload, before it can learn that the new one refuses.
TEST_F(RouterSlowNameTest, ALookUpForARemoteThatWasRemovedIsAbandonedSilently) {
  const auto router = startRouter();
  writeFile("127.0.0.1:9");
  router->signal(SIGHUP);
  router->waitUntilSaid("cannot reach 127.0.0.1:9: the connection failed: ");

  const auto lookUp = endLookUp();

  router->waitUntilSaid("a name look-up ended after it had been cancelled");
  EXPECT_THAT(router->said(), Not(HasSubstr("detached thread")));
}

}  // namespace
}  // namespace mpf::test
