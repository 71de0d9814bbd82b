// SPDX-License-Identifier: MIT
// LocalServers: what a peer is told of the servers of this host, and a request of its clients.
#include "router/incoming/local_servers.h"

#include <mpf/message_server.h>

#include "server/relay_server.h"
#include "tests/router/client_items.h"
#include "tests/router/router_parts_fixture.h"
#include "tests/support/no_descriptors.h"

namespace mpf::test {
namespace {

using router::LocalServers;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class LocalServersTest : public RouterPartsTest {
 protected:
  ~LocalServersTest() noexcept override = default;

  void SetUp() override {
    context_.config.serve = {{.location = 1, .local = 0}};
    onPlain_ = [this](router::PlainItem& item) { servers_->handle(item); };
    startGreeted();
    servers_.emplace(context_, *line_, record_, "", "10.0.0.7:40000");
    onItem_ = [this](wire::Item::Reader item) { servers_->handle(item); };
    onRoom_ = [this] { servers_->run(); };
  }
  void TearDown() override {
    servers_.reset();
    RouterPartsTest::TearDown();
  }
  void sendItems(const std::vector<Fill>& items) { send(frameOf(items)); }
  // Starts the server and binds to it, as binding 1.
  void bindToServer() {
    server_.emplace(backplane_, "echo", ServerOptions{.queueSize = 7});
    sendItems({bind(1)});
    EXPECT_THAT(nextItem(), HasSubstr("state = there"));
  }
  void lookAtAll() {
    monitors_.lookAtAll();
    servers_->onServers();
  }
  // Opens a client of binding 1.
  void openClient(std::uint32_t number = 1) {
    sendItems({open(number, 1, monitors_.of({0, "echo"})->incarnation())});
  }
  // Sends a request of client 1, which the server receives.
  Message receiveRequest(std::uint32_t id, std::int32_t value = 0) {
    sendItems({test::request(1, id, value)});
    Message request;
    runUntil([&] { return static_cast<bool>(request = server_->receive()); });
    return request;
  }

  std::optional<MessageServer> server_;
  std::optional<LocalServers> servers_;
};

TEST_F(LocalServersTest, TellWhenAServerStartsAndEnds) {
  sendItems({bind(1)});
  EXPECT_THAT(nextItem(), AllOf(StartsWith("(server = (binding = 1, "), HasSubstr("absent")));

  server_.emplace(backplane_, "echo", ServerOptions{.queueSize = 7});
  lookAtAll();
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("state = there"), HasSubstr("queueSize = 7")));

  server_.reset();
  lookAtAll();
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("binding = 1"), HasSubstr("absent")));
}

// A proxy of another router of this host: locations of routers may form a cycle.
TEST_F(LocalServersTest, TellHowFarAServerIsAndDoNotOfferOneThatIsTooFar) {
  std::optional<RelayServer> proxy;
  proxy.emplace(backplane_, "echo", ServerOptions{}, router::kMaxHops - 1);
  sendItems({bind(1)});
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("state = there"), HasSubstr("hops = 7")));

  proxy.reset();
  proxy.emplace(backplane_, "echo", ServerOptions{}, router::kMaxHops);
  lookAtAll();

  EXPECT_THAT(nextItem(), AllOf(HasSubstr("absent"), HasSubstr("8 connections between routers")));
  EXPECT_THAT(logged_, HasSubstr("echo at location 1 cannot be offered to 10.0.0.7:40000: 8 "
                                 "connections between routers lead to it"));
}

TEST_F(LocalServersTest, RefuseWhatIsNotServed) {
  sendItems({bind(1, "echo", 2), bind(2, "")});

  EXPECT_THAT(nextItem(), AllOf(HasSubstr("binding = 1"), HasSubstr("state = refused"),
                                HasSubstr("echo at location 2 is not allowed")));
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("binding = 2"), HasSubstr("state = refused"),
                                HasSubstr("is not a valid server name")));
  EXPECT_EQ(record_->bindings, 0u);
  EXPECT_THAT(logged_, HasSubstr("10.0.0.7:40000: server echo at location 2 is not allowed"));
}

TEST_F(LocalServersTest, RefuseABindingThatTheNewConfigurationDoesNotAllow) {
  bindToServer();
  context_.config.allow = {{.peer = "*", .locations = {}, .servers = {"dac"}}};

  servers_->onConfig();

  EXPECT_THAT(nextItem(),
              AllOf(HasSubstr("state = refused"), HasSubstr("the configuration has changed")));
  EXPECT_EQ(record_->bindings, 0u);
}

TEST_F(LocalServersTest, CarryARequestAndItsReply) {
  bindToServer();
  openClient();
  auto request = receiveRequest(5, 42);
  auto* fields = request.tryAs<Int32>();
  ASSERT_NE(fields, nullptr);
  EXPECT_EQ(fields->value, 42);
  EXPECT_EQ(record_->clients, 1u);

  fields->value = 43;
  EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);

  EXPECT_THAT(nextItem(), AllOf(StartsWith("(reply = (client = 1, requestId = 5, isFirst = true"),
                                HasSubstr("value = 43")));
  sendItems({test::close(1)});
  EXPECT_EQ(record_->clients, 0u);
}

TEST_F(LocalServersTest, RefuseAClientThatLacksADescriptor) {
  bindToServer();
  openClient();
  {
    const NoDescriptors none;
    openClient(2);
    EXPECT_THAT(nextItem(), AllOf(StartsWith("(refuse = (client = 2"), HasSubstr("open files")));
  }
  EXPECT_THAT(logged_, HasSubstr("a client is refused: "));
}

// All requests end before the peer is told that the server is absent.
TEST_F(LocalServersTest, EndTheRequestsOfAServerBeforeItIsAbsent) {
  bindToServer();
  openClient();
  const auto received = receiveRequest(5);
  sendItems({test::request(1, 6)});

  server_.reset();
  lookAtAll();

  EXPECT_THAT(nextItem(),
              AllOf(StartsWith("(fate = (client = 1, requestId = 5"), HasSubstr("outcomeUnknown")));
  EXPECT_THAT(nextItem(),
              AllOf(StartsWith("(fate = (client = 1, requestId = 6"), HasSubstr("neverTaken")));
  EXPECT_THAT(nextItem(), HasSubstr("state = absent"));
  sendItems({test::request(1, 7)});
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("requestId = 7"), HasSubstr("neverTaken"),
                                HasSubstr("the server is gone")));
}

TEST_F(LocalServersTest, EndTheRequestsThatWaitForTheServerToAcceptTheirClient) {
  bindToServer();
  openClient();
  sendItems({test::request(1, 5)});

  server_.reset();
  lookAtAll();

  EXPECT_THAT(nextItem(),
              AllOf(StartsWith("(fate = (client = 1, requestId = 5"), HasSubstr("neverTaken")));
  EXPECT_THAT(nextItem(), HasSubstr("state = absent"));
}

TEST_F(LocalServersTest, ReportALostFirstReplyAsOutcomeUnknown) {
  const auto sentInstead = [this](bool isFirst) {
    capnp::MallocMessageBuilder message;
    auto item = message.initRoot<wire::Item>();
    servers_->loseReply(
        {.isFirst = isFirst, .client = 1, .requestId = 5, .message = Int32Message()}, "too large",
        item);
    return router::toStd(kj::str(item));
  };

  const auto first = sentInstead(true);
  const auto later = sentInstead(false);

  EXPECT_THAT(first, AllOf(StartsWith("(fate = (client = 1, requestId = 5"),
                           HasSubstr("outcomeUnknown"), HasSubstr("too large")));
  EXPECT_THAT(later, Not(HasSubstr("fate")));
}

TEST_F(LocalServersTest, EndTheConnectionOfAPeerThatOpensABindingTwice) {
  sendItems({bind(1), bind(1)});

  EXPECT_THAT(nextItem(), HasSubstr("absent"));
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("farewell"), HasSubstr("binding 1 is open already")));
  close();
}

TEST_F(LocalServersTest, EndTheConnectionOfAPeerThatOpensAClientWithoutAWindow) {
  sendItems({open(1, 1, 1, 0)});

  EXPECT_THAT(nextItem(), AllOf(HasSubstr("farewell"), HasSubstr("code = protocol"),
                                HasSubstr("client 1 has a window of 0 bytes")));
  close();
}

}  // namespace
}  // namespace mpf::test
