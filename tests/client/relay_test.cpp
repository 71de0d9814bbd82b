// SPDX-License-Identifier: MIT
// Functions of clients and servers for routers, which act on behalf of others.
#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

class RelayTest : public ClientTest {
 protected:
  RelayServer& startWatched() {
    auto& server = startServer({.queueSize = 4});
    server.onClient(
        [this](std::uint64_t client, bool isThere) { comings_.emplace_back(client, isThere); });
    serverRuns_ = false;
    return server;
  }
  // The next request, without a handler.
  Message take() {
    for (;;) {
      if (auto request = server_->receive()) return request;
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  void bindByHand() {
    client_.bind("device[0]/a");
    while (!client_.isConnected()) {
      EXPECT_FALSE(server_->receive());
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  std::vector<std::pair<std::uint64_t, bool>> comings_;
};

TEST_F(RelayTest, AServerReportsClientsThatConnectAndDisconnect) {
  startWatched();
  bindByHand();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  auto request = take();
  const auto client = server_->clientOf(request);
  EXPECT_THAT(comings_, testing::ElementsAre(std::pair(client, true)));
  static_cast<void>(server_->reply(std::move(request)));
  static_cast<void>(next());

  {
    MessageClient second(dispatcher_, [](Message&&) {});
    second.bind("device[0]/a");
    while (comings_.size() != 2) EXPECT_FALSE(server_->receive());
  }
  while (comings_.size() != 3) EXPECT_FALSE(server_->receive());
  EXPECT_EQ(comings_[1].second, true);
  EXPECT_EQ(comings_[2], std::pair(comings_[1].first, false));
}

TEST_F(RelayTest, AReplyByNumbersReachesItsRequest) {
  auto& server = startWatched();
  bindByHand();
  ASSERT_EQ(client_.send(Int32Message({.value = 3})), SendResult::sent);
  std::uint64_t client = 0;
  std::uint32_t id = 0;
  {
    auto request = take();
    client = server.clientOf(request);
    id = request.route().requestId;
    auto route = request.route();
    route.keeper = nullptr;
    request.setRoute(route);
  }
  EXPECT_TRUE(server.owes(client, id));
  EXPECT_FALSE(server.owes(client, id + 1));

  EXPECT_EQ(server.replyTo(client, id, Int32Message({.value = 4})), ReplyResult::sent);
  EXPECT_FALSE(server.owes(client, id));
  EXPECT_EQ(server.replyTo(client, id, Int32Message({.value = 5})), ReplyResult::sent);
  EXPECT_EQ(server.replyTo(client + 1, id, Int32Message()), ReplyResult::clientGone);

  const auto first = next();
  const auto second = next();
  EXPECT_TRUE(RelayClient::endsRequest(first));
  EXPECT_FALSE(RelayClient::endsRequest(second));
  EXPECT_EQ(first.tryAs<Int32>()->value, 4);
  EXPECT_EQ(second.tryAs<Int32>()->value, 5);
}

TEST_F(RelayTest, ARequestHasTheIdThatTheCallerChose) {
  startWatched();
  bindByHand();
  ASSERT_EQ(client_.sendAs(77, Int32Message(), Deadline::never()), SendResult::sent);
  EXPECT_EQ(client_.sendAs(77, Int32Message(), Deadline::never()), SendResult::tooManyOutstanding);

  auto request = take();
  EXPECT_EQ(request.route().requestId, 77u);
  static_cast<void>(server_->reply(std::move(request)));
  EXPECT_EQ(next().route().requestId, 77u);
  EXPECT_EQ(client_.sendAs(77, Int32Message(), Deadline::never()), SendResult::sent)
      << "its place is free again";
  static_cast<void>(server_->reply(take()));
  static_cast<void>(next());
}

TEST_F(RelayTest, AServerGetsTheDeadlineOfARequest) {
  startWatched();
  bindByHand();
  const auto until = Deadline::after(1h);
  ASSERT_EQ(client_.send(Int32Message(), until), SendResult::sent);
  static_cast<void>(server_->reply(take()));
  EXPECT_EQ(server_->takeBefore().ns(), until.ns());
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  static_cast<void>(server_->reply(take()));
  EXPECT_TRUE(server_->takeBefore().isNever());
  static_cast<void>(next());
  static_cast<void>(next());
}

// While a client is paused, the reply queue of its server becomes full; after resume() no reply is
// missing.
TEST_F(RelayTest, APausedClientLeavesRepliesInTheQueue) {
  auto& server = startWatched();
  bindByHand();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  auto request = take();
  client_.pause();

  int sent = 0;
  for (;; ++sent) {
    auto extra = server.allocReplyMessage<Int32>(request);
    extra->value = sent;
    if (server.reply(std::move(extra)) != ReplyResult::sent) break;
  }
  for (int looks = 0; looks < 10; ++looks) dispatcher_.runOnce(Deadline::after(1ms));
  EXPECT_THAT(messages_, testing::IsEmpty());

  client_.resume();
  for (int got = 0; got < sent; ++got) EXPECT_EQ(next().tryAs<Int32>()->value, got);
}

// A router reports in this way that a queue behind it is full.
TEST_F(RelayTest, AServerMayReportThatAQueueIsFull) {
  auto& server = startWatched();
  bindByHand();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  auto request = take();
  const auto client = server.clientOf(request);

  EXPECT_EQ(server.replyTo(client, 0, ConnectMessage({.status = ConnectStatus::connectQueueFull})),
            ReplyResult::sent);
  runUntil([&] { return news_.size() == 2; });
  EXPECT_THAT(news_,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectQueueFull));
  static_cast<void>(server.reply(std::move(request)));
  static_cast<void>(next());
}

}  // namespace
}  // namespace mpf::test
