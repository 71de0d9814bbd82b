// SPDX-License-Identifier: MIT
// RemoteServers: binds to the servers that local clients wait for, and a server of the peer that
// local clients use through its proxy.
#include "router/outgoing/remote_servers.h"

#include <unistd.h>

#include <mpf/message_server.h>

#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/router/router_parts_fixture.h"
#include "tests/router/server_items.h"
#include "tests/support/caller.h"

namespace mpf::test {
namespace {

using router::RemoteServers;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class RemoteServersTest : public RouterPartsTest {
 protected:
  ~RemoteServersTest() noexcept override = default;

  void SetUp() override {
    onPlain_ = [this](router::PlainItem& item) { servers_->handle(item); };
    startGreeted();
    servers_.emplace(context_, remote_, record_, context_.log);
    onItem_ = [this](wire::Item::Reader item) { servers_->handle(item); };
    onRoom_ = [this] { servers_->pump(); };
  }
  void TearDown() override {
    caller_.reset();
    servers_->disconnect("the test ends");
    servers_.reset();
    RouterPartsTest::TearDown();
  }
  void sendItems(const std::vector<Fill>& items) { send(frameOf(items)); }
  // A local client connects to the server "echo" of the peer.
  void connectClient() {
    servers_->connect(*line_);
    servers_->setPendingBinds({{1, "echo"}});
    EXPECT_THAT(nextItem(), StartsWith("(bind = "));
    sendItems({server(1, wire::Server::State::THERE)});
    caller_.emplace(dispatcher_);
    runClientUntil([this] { return caller_->isConnected(); });
    EXPECT_THAT(nextItem(), StartsWith("(open = (client = 1, binding = 1"));
  }
  // Sends a request, which the peer receives. Returns its id.
  std::uint32_t sendRequest() {
    const auto id = caller_->send(Int32Message({.value = 42}));
    EXPECT_THAT(nextItem(), AllOf(StartsWith("(request = (client = 1, "), HasSubstr("value = 42")));
    return id;
  }
  void runClientUntil(const std::function<bool()>& isDone) {
    runUntil([&] {
      dispatcher_.runPending();
      return isDone();
    });
  }

  const router::Remote remote_{.locations = {1},
                               .address = {"far", 9900},
                               .security = router::Security::plain,
                               .tlsName = {}};
  std::optional<RemoteServers> servers_;
  Dispatcher dispatcher_{backplane_, {}};
  std::optional<Caller> caller_;
};

TEST_F(RemoteServersTest, BindToTheServersAtTheirLocationsOnceConnected) {
  servers_->setPendingBinds({{1, "echo"}, {2, "elsewhere"}});
  EXPECT_EQ(record_->bindings, 1u);

  servers_->connect(*line_);
  EXPECT_EQ(nextItem(), "(bind = (binding = 1, location = 1, server = \"echo\"))");

  servers_->setPendingBinds({{1, "dac"}, {1, "echo"}});
  EXPECT_EQ(nextItem(), "(bind = (binding = 2, location = 1, server = \"dac\"))");
  EXPECT_EQ(record_->bindings, 2u);
}

TEST_F(RemoteServersTest, BindAgainOverANewConnection) {
  servers_->setPendingBinds({{1, "echo"}});
  servers_->connect(*line_);
  EXPECT_THAT(nextItem(), StartsWith("(bind = (binding = 1"));
  servers_->disconnect("cut");

  servers_->connect(*line_);

  EXPECT_EQ(nextItem(), "(bind = (binding = 1, location = 1, server = \"echo\"))");
}

TEST_F(RemoteServersTest, LogARefusedBindOnce) {
  servers_->setPendingBinds({{1, "echo"}});
  for (int connection = 0; connection < 2; ++connection) {
    servers_->connect(*line_);
    EXPECT_THAT(nextItem(), StartsWith("(bind = (binding = 1"));
    sendItems({server(1, wire::Server::State::REFUSED)});
    servers_->disconnect("cut");
  }

  EXPECT_EQ(logged_, "echo at location 1: far:9900 refused the bind: a reason of the rogue\n");
}

TEST_F(RemoteServersTest, CarryARequestAndItsReply) {
  connectClient();
  const auto id = sendRequest();

  sendItems({test::reply(1, id, true, 43)});
  runClientUntil([this] { return !caller_->messages.empty(); });

  const auto reply = caller_->take();
  const auto* fields = reply.tryAs<Int32>();
  ASSERT_NE(fields, nullptr);
  EXPECT_EQ(fields->value, 43);
  EXPECT_THAT(caller_->open, IsEmpty());
}

TEST_F(RemoteServersTest, CountTheHopsToAServer) {
  connectClient();

  const auto window = PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 1, "echo"),
                                          layout::SegmentKind::serverWindow);
  ASSERT_TRUE(window);
  EXPECT_EQ(window->header().hops, 4u) << "one more than the peer has said";
}

TEST_F(RemoteServersTest, EndPendingRequestsAndDisconnectTheClientWhenTheServerIsAbsent) {
  connectClient();
  sendRequest();

  sendItems({server(1, wire::Server::State::ABSENT)});
  runClientUntil([this] { return !caller_->isConnected(); });

  EXPECT_EQ(fateOf(caller_->take()), Fate::neverTaken);
  EXPECT_THAT(caller_->messages, IsEmpty());
}

TEST_F(RemoteServersTest, EndARequestThatThePeerMayHaveAsOutcomeUnknownWhenDisconnected) {
  connectClient();
  sendRequest();

  servers_->disconnect("cut");
  runClientUntil([this] { return !caller_->isConnected(); });

  EXPECT_EQ(fateOf(caller_->take()), Fate::outcomeUnknown);
  EXPECT_THAT(caller_->messages, IsEmpty());
}

// The router does not wait for the client. A reply with a number of missed ones is in a pool of
// which only the proxy removes the files.
TEST_F(RemoteServersTest, LeaveRepliesToAClientThatReceivesThemAfterTheConnection) {
  connectClient();
  const auto id = sendRequest();
  sendItems({test::reply(1, id, true), [id](wire::Item::Builder item) {
               auto further = item.initReply();
               further.setClient(1);
               further.setRequestId(id);
               further.setMissed(5);
               further.initMessage().initUser().initValue(100'000);
             }});

  servers_->disconnect("cut");
  runClientUntil([this] { return !caller_->isConnected(); });

  ASSERT_EQ(caller_->messages.size(), 2u);
  EXPECT_EQ(caller_->messages[1].getMissed(), 5u);
  servers_->whenProxiesAreGone().wait(io_.waitScope);
}

TEST_F(RemoteServersTest, OfferAServerOnceItsNameIsFree) {
  std::optional<MessageServer> other(std::in_place, backplane_, "echo",
                                     ServerOptions{.location = 1});
  servers_->connect(*line_);
  servers_->setPendingBinds({{1, "echo"}});
  EXPECT_THAT(nextItem(), StartsWith("(bind = "));

  sendItems({server(1, wire::Server::State::THERE)});
  EXPECT_THAT(logged_, AllOf(HasSubstr("cannot be offered here: server \"echo\" at location 1 is "
                                       "already running"),
                             HasSubstr(std::to_string(::getpid()))));
  other.reset();

  runUntil([this] { return logged_.find("is available") != std::string::npos; });
}

TEST_F(RemoteServersTest, RefuseARequestThatCannotBeSent) {
  connectClient();
  const auto id = sendRequest();

  servers_->refuse({.isRequest = true, .client = 1, .requestId = id, .message = {}}, "too large");
  runClientUntil([this] { return caller_->open.empty(); });

  EXPECT_EQ(fateOf(caller_->take()), Fate::refused);
  EXPECT_THAT(logged_, HasSubstr("cannot be sent to far:9900 and is refused: too large"));
}

}  // namespace
}  // namespace mpf::test
