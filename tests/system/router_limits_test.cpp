// SPDX-License-Identifier: MIT
// Limits of a router: it refuses clients, callers and servers beyond a limit, serves the existing
// ones, and accepts others when there is room again.
#include <arpa/inet.h>
#include <sys/resource.h>

#include <algorithm>

#include "tests/support/test_backplane.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

// Connects to an address and sends nothing.
FileDescriptor callTo(const std::string& address) {
  FileDescriptor socket(checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
  checkCall(::connect(socket.get(), reinterpret_cast<sockaddr*>(&to), sizeof to), "connect",
            address);
  return socket;
}

void limitDescriptors(rlim_t most) {
  const rlimit limit{most, most};
  if (::setrlimit(RLIMIT_NOFILE, &limit) != 0) ::_exit(126);
}

// Another local router, with its own backplane.
struct Neighbour {
  explicit Neighbour(const std::string& address)
      : router(std::vector<std::string>{"--backplane", backplane.name(), "--remote",
                                        std::to_string(RouterPair::kLocation) + "=" + address,
                                        "--plain", "--last-retry", "200ms"}) {}
  TestBackplane backplane;
  RouterProcess router;
};

class RouterLimitsTest : public RouterTest {
 protected:
  explicit RouterLimitsTest(RouterPlace place = {}) : RouterTest(std::move(place)) {}
  // Expects that a client of the neighbour gets a reply.
  void expectAnswerFor(const Neighbour& neighbour) {
    Dispatcher dispatcher(neighbour.backplane);
    Caller caller(dispatcher);
    const auto run = [&](const auto& until) {
      while (!until()) {
        runServer();
        dispatcher.runOnce(Deadline::after(200us));
        dispatcher_->runOnce(Deadline::atNs(0));
      }
    };
    run([&] { return caller.isConnected(); });
    caller.send(Int32Message({.value = 5}));
    run([&] { return !caller.messages.empty(); });
    EXPECT_EQ(caller.take().tryAs<Int32>()->value, 5);
  }
};

TEST_F(RouterLimitsTest, ClientsBeyondTheLimitAreRefusedUntilOthersLeave) {
  routers_.startFar({"--max-clients", "2"});
  routers_.startNear();
  openServer();
  caller_.emplace(*dispatcher_);
  runUntil([&] { return caller_->isConnected(); });
  std::optional<Caller> second(*dispatcher_);
  runUntil([&] { return second->isConnected(); });

  Caller third(*dispatcher_);
  runUntil([&] { return third.isConnected(); });
  third.send(Int32Message());
  runUntil([&] { return !third.messages.empty(); });
  EXPECT_EQ(fateOf(third.take()), Fate::refused);
  routers_.nearRouter().waitUntilSaid("accepts at most 2 clients");
  expectAnswer();

  second.reset();
  for (auto refused = true;
       refused;) {  // the local router may not have noticed yet that a client has left
    third.send(Int32Message());
    runUntil([&] { return !third.messages.empty(); });
    refused = fateOf(third.take()) == Fate::refused;
  }
  EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectYes));
}

TEST_F(RouterLimitsTest, ConnectionsBeyondTheLimitAreRefusedUntilOthersEnd) {
  routers_.startFar({"--max-connections", "1"});
  routers_.startNear();
  openServer();
  caller_.emplace(*dispatcher_);
  runUntil([&] { return caller_->isConnected(); });

  const Neighbour neighbour(routers_.address());
  routers_.farRouter().waitUntilSaid("rejected: there are already");
  expectAnswer();

  routers_.nearRouter().end(SIGTERM);
  expectAnswerFor(neighbour);
}

// Makes a connection and resets it before the router accepts it.
void callAndReset(const std::string& address) {
  const auto socket = callTo(address);
  const linger atOnce{.l_onoff = 1, .l_linger = 0};
  checkCall(::setsockopt(socket.get(), SOL_SOCKET, SO_LINGER, &atOnce, sizeof atOnce),
            "setsockopt");
}

TEST_F(RouterLimitsTest, ConnectionsThatAreResetAtOnceDoNotCount) {
  routers_.startFar({"--max-connections", "1"});
  routers_.farRouter().stop();
  for (int i = 0; i < 10; ++i) callAndReset(routers_.address());
  routers_.farRouter().resume();

  const Neighbour neighbour(routers_.address());
  openServer();
  expectAnswerFor(neighbour);
}

// The number of files decides which descriptor the router cannot get.
class RouterFewDescriptorsTest : public RouterLimitsTest,
                                 public testing::WithParamInterface<rlim_t> {
 protected:
  RouterFewDescriptorsTest()
      : RouterLimitsTest(
            {.address = {}, .enterNear = {}, .enterFar = [] { limitDescriptors(GetParam()); }}) {}
};
INSTANTIATE_TEST_SUITE_P(Of, RouterFewDescriptorsTest, testing::Values(48, 49));

TEST_P(RouterFewDescriptorsTest, CallersBeyondTheLimitOfFilesWaitUntilOthersHangUp) {
  startAll();
  expectAnswer();  // both routers now have all descriptors that this needs
  std::vector<FileDescriptor> callers;
  routers_.farRouter().stop();
  for (int i = 0; i < 60; ++i) callers.push_back(callTo(routers_.address()));
  routers_.farRouter().resume();
  routers_.farRouter().waitUntilSaid("Too many open files");
  for (int i = 0; i < 20; ++i) expectAnswer();

  callers.clear();

  const Neighbour neighbour(routers_.address());
  expectAnswerFor(neighbour);
  expectAnswer();
  EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectYes));
}

// Each server that clients wait for needs some files of both routers.
class RouterFewFilesTest : public RouterLimitsTest {
 protected:
  using RouterLimitsTest::RouterLimitsTest;
  // `limited`: the router that reports the limit.
  void expectThatOthersGoOnAndAllGetInLater(RouterProcess& (RouterPair::*limited)()) {
    startAll();
    expectAnswer();  // both routers now have all descriptors that this needs
    for (int i = 0; i < kServers; ++i) {
      const auto name = "server" + std::to_string(100 + i);
      servers_.push_back(std::make_unique<MessageServer>(
          routers_.far(), name, ServerOptions{.location = RouterPair::kLocation}));
      callers_.push_back(std::make_unique<Caller>(*dispatcher_, name));
    }
    (routers_.*limited)().waitUntilSaid("Too many open files");
    for (int i = 0; i < 20; ++i) expectAnswer();

    callers_.erase(callers_.begin(), callers_.end() - kKept);
    servers_.erase(servers_.begin(), servers_.end() - kKept);

    for (std::size_t i = 0; i < kKept; ++i) expectAnswerOf(*callers_[i], *servers_[i]);
    expectAnswer();
    EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectYes));
  }
  void TearDown() override {
    callers_.clear();
    servers_.clear();
    RouterLimitsTest::TearDown();
  }

 private:
  static constexpr int kServers = 40;
  static constexpr int kKept = 3;
  void expectAnswerOf(Caller& caller, MessageServer& server) {
    runUntil([&] { return caller.isConnected(); });
    caller.send(Int32Message({.value = 9}));
    runUntil([&] {
      if (auto request = server.receive()) static_cast<void>(server.reply(std::move(request)));
      return !caller.messages.empty();
    });
    EXPECT_EQ(fateOf(caller.messages.front()), std::nullopt);
    EXPECT_EQ(caller.take().tryAs<Int32>()->value, 9);
  }
  std::vector<std::unique_ptr<MessageServer>> servers_;
  std::vector<std::unique_ptr<Caller>> callers_;
};

class RouterFewFilesNearTest : public RouterFewFilesTest {
 protected:
  RouterFewFilesNearTest()
      : RouterFewFilesTest(
            {.address = {}, .enterNear = [] { limitDescriptors(40); }, .enterFar = {}}) {}
};

TEST_F(RouterFewFilesNearTest, ServersBeyondTheLimitOfFilesWaitUntilOthersEnd) {
  expectThatOthersGoOnAndAllGetInLater(&RouterPair::nearRouter);
}

class RouterFewFilesFarTest : public RouterFewFilesTest {
 protected:
  RouterFewFilesFarTest()
      : RouterFewFilesTest(
            {.address = {}, .enterNear = {}, .enterFar = [] { limitDescriptors(40); }}) {}
};

TEST_F(RouterFewFilesFarTest, ServersBeyondTheLimitOfFilesWaitUntilOthersEnd) {
  expectThatOthersGoOnAndAllGetInLater(&RouterPair::farRouter);
}

}  // namespace
}  // namespace mpf::test
