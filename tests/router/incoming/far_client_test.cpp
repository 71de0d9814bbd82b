// SPDX-License-Identifier: MIT
// FarClient: requests that are held, and the window of its replies.
#include "router/incoming/far_client.h"

#include <mpf/message_server.h>

#include "router/readable.h"
#include "tests/router/client_items.h"
#include "tests/router/router_parts_fixture.h"

namespace mpf::test {
namespace {

using router::FarClient;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class FarClientTest : public RouterPartsTest {
 protected:
  ~FarClientTest() noexcept override = default;

  void SetUp() override {
    onPlain_ = [this](router::PlainItem& item) { client_->request(item); };
    onPlainItems_ = [this](const router::PlainItems& items) { client_->request(items); };
    startGreeted();
    onItem_ = [this](wire::Item::Reader item) {
      if (item.isRequest()) client_->request(item.getRequest());
      if (item.isCredit()) client_->credit(item.getCredit().getBytes());
    };
  }
  void TearDown() override {
    client_.reset();
    RouterPartsTest::TearDown();
  }
  void makeClient(const FarClient::Terms& terms) {
    shared_.emplace(context_.timer, dispatcher_, *line_, record_, heldBytes_, events_);
    client_.emplace(*shared_, terms);
    client_->bind("echo", 0);
  }
  // A server, and a client of it with a window of `bytes`.
  void connectToServer(std::uint32_t bytes, const ServerOptions& options = {}) {
    server_.emplace(backplane_, "echo", options);
    const auto monitor = monitors_.of({0, "echo"});
    ASSERT_TRUE(monitor->look());
    makeClient(
        {.number = 1, .incarnation = monitor->incarnation(), .queueSize = 4, .window = bytes});
  }
  // Sends request 5, which the server receives.
  Message sendRequest() {
    sendItems({test::request(1, 5)});
    Message request;
    runUntil([&] { return static_cast<bool>(request = server_->receive()); });
    return request;
  }
  // A client whose window has room for one reply, and a server that has sent two.
  void sendTwoReplies() {
    connectToServer(1);
    sendItems({test::request(1, 5), test::request(1, 6)});
    for (int replies = 0; replies < 2;) {
      runUntil([&] { return server_->waitForMessage(Deadline::after(Nanoseconds(0))); });
      while (auto request = server_->receive()) {
        EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
        ++replies;
      }
    }
    EXPECT_THAT(nextItem(), StartsWith("(reply = (client = 1, requestId = 5"));
    dispatcher_.runPending();
  }
  void sendItems(const std::vector<Fill>& items) { send(frameOf(items)); }
  // Expects that the peer has received all items.
  void expectNoItem() {
    sendItems({ping(1)});
    EXPECT_THAT(nextItem(), StartsWith("(pong"));
  }

  Dispatcher dispatcher_{backplane_, {.waitMode = WaitMode::block, .label = {}}};
  const router::Readable readable_{context_.port, dispatcher_.descriptor(),
                                   [this] { dispatcher_.runPending(); }};
  std::size_t heldBytes_ = 0;
  int disconnects_ = 0;
  const FarClient::Events events_{.onConnected = [](FarClient&) {},
                                  .onDisconnected = [this](FarClient&) { ++disconnects_; },
                                  .onRefused = [](FarClient&, const std::string&) {}};
  std::optional<FarClient::Shared> shared_;
  std::optional<MessageServer> server_;
  std::optional<FarClient> client_;
};

TEST_F(FarClientTest, RequestsBeyondTheQueueSizeAreRefusedAndReportedOnce) {
  makeClient({.number = 1, .queueSize = 2, .window = 4096});

  sendItems({test::request(1, 1), test::request(1, 2), test::request(1, 3), test::request(1, 4)});

  EXPECT_THAT(nextItem(), AllOf(HasSubstr("requestId = 3"), HasSubstr("refused")));
  EXPECT_EQ(nextItem(), "(queueFull = 1)");
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("requestId = 4"), HasSubstr("refused")));
  expectNoItem();
}

TEST_F(FarClientTest, AHeldRequestExpires) {
  makeClient({.number = 1, .queueSize = 2, .window = 4096});

  sendItems({[](wire::Item::Builder item) {
    test::request(1, 5)(item);
    item.getRequest().setTakeWithinNs(1);
  }});

  EXPECT_THAT(nextItem(), AllOf(HasSubstr("requestId = 5"), HasSubstr("expired")));
}

TEST_F(FarClientTest, AnotherIncarnationOfTheServerReceivesNoRequest) {
  server_.emplace(backplane_, "echo");
  makeClient({.number = 1, .incarnation = 1, .queueSize = 2, .window = 4096});
  sendItems({test::request(1, 5)});

  runUntil([&] {
    EXPECT_FALSE(server_->receive());
    return heldBytes_ == 0;
  });

  ASSERT_THAT(nextItem(), AllOf(HasSubstr("requestId = 5"), HasSubstr("neverTaken")));
  sendItems({test::request(1, 6)});
  EXPECT_THAT(nextItem(), AllOf(HasSubstr("requestId = 6"), HasSubstr("neverTaken")));
}

// Requests that come together are held, sent together, and refused one by one.
TEST_F(FarClientTest, RequestsThatComeTogetherAreHeldAndSentInOrder) {
  connectToServer(4096, {.queueSize = 4});
  sendItems({test::request(1, 1), test::request(1, 2), test::request(1, 3)});
  std::vector<std::uint32_t> ids;
  const auto receive = [&](std::size_t count) {
    runUntil([&] {
      while (auto request = server_->receive()) {
        ids.push_back(request.route().requestId);
        EXPECT_TRUE(client_->isConnected());
        EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
      }
      return ids.size() >= count;
    });
  };
  receive(3);
  for (const auto* id : {"requestId = 1,", "requestId = 2,", "requestId = 3,"})
    EXPECT_THAT(nextItem(), AllOf(StartsWith("(reply"), HasSubstr(id)));

  sendItems({test::request(1, 4), test::request(1, 5), test::request(1, 6), test::request(1, 7),
             test::request(1, 8)});

  EXPECT_THAT(nextItem(), AllOf(HasSubstr("requestId = 8"), HasSubstr("refused")));
  receive(7);
  EXPECT_THAT(ids, testing::ElementsAre(1, 2, 3, 4, 5, 6, 7));
}

TEST_F(FarClientTest, RepliesThatComeTogetherDoNotExceedTheWindow) {
  connectToServer(64 + 1);
  std::vector<Fill> requests;
  for (std::uint32_t id = 1; id <= 4; ++id) requests.push_back(test::request(1, id));
  sendItems(requests);
  int replies = 0;
  runUntil([&] {
    while (auto request = server_->receive()) {
      EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
      ++replies;
    }
    return replies == 4;
  });

  for (const auto* id : {"requestId = 1,", "requestId = 2,"})
    EXPECT_THAT(nextItem(), AllOf(StartsWith("(reply"), HasSubstr(id)));
  expectNoItem();
  sendItems({test::credit(1, 2 * 64)});
  for (const auto* id : {"requestId = 3,", "requestId = 4,"})
    EXPECT_THAT(nextItem(), AllOf(StartsWith("(reply"), HasSubstr(id)));
}

TEST_F(FarClientTest, RepliesBeyondTheWindowWaitForCredit) {
  sendTwoReplies();
  expectNoItem();

  sendItems({test::credit(1, 64)});

  EXPECT_THAT(nextItem(), StartsWith("(reply = (client = 1, requestId = 6"));
}

TEST_F(FarClientTest, RepliesBeyondTheWindowAreOutcomeUnknownWhenTheServerIsGone) {
  sendTwoReplies();
  server_.reset();

  client_->onServerGone();

  EXPECT_THAT(nextItem(),
              AllOf(StartsWith("(fate = (client = 1, requestId = 6"), HasSubstr("outcomeUnknown")));
  runUntil([this] { return disconnects_ == 1; });
  EXPECT_FALSE(client_->isConnected());
}

// The test does not let the client run while the server publishes.
TEST_F(FarClientTest, ReportsHowManyPublishedMessagesTheServerHasDropped) {
  connectToServer(4096, {.maxBorrowed = 1});
  const auto request = sendRequest();
  const auto publish = [&] { return server_->publish(Int32Message(), request); };
  EXPECT_EQ(publish(), ReplyResult::sent);
  for (int dropped = 0; dropped < 3; ++dropped) EXPECT_EQ(publish(), ReplyResult::queueFull);
  EXPECT_THAT(nextItem(), HasSubstr("missed = 0"));

  EXPECT_EQ(publish(), ReplyResult::sent);

  EXPECT_THAT(nextItem(),
              AllOf(StartsWith("(reply = (client = 1, requestId = 5"), HasSubstr("missed = 3")));
}

// Replies beyond the window of a server that is gone; then there is credit again.
TEST_F(FarClientTest, ReportsHowManyFurtherRepliesItHasDropped) {
  connectToServer(65);
  auto request = sendRequest();
  const auto furtherReply = [reply = request.duplicate()] { return reply.duplicate(); };
  EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  EXPECT_THAT(nextItem(), HasSubstr("isFirst = true"));
  client_->onServerGone();
  for (int reply = 0; reply < 3; ++reply)
    EXPECT_EQ(server_->reply(furtherReply()), ReplyResult::sent);
  EXPECT_THAT(nextItem(), HasSubstr("missed = 0"));
  sendItems({test::credit(1, 128)});
  expectNoItem();

  // They come together.
  for (int reply = 0; reply < 2; ++reply)
    EXPECT_EQ(server_->reply(furtherReply()), ReplyResult::sent);

  EXPECT_THAT(nextItem(),
              AllOf(StartsWith("(reply = (client = 1, requestId = 5"), HasSubstr("missed = 2")));
}

}  // namespace
}  // namespace mpf::test
