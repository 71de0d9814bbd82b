// SPDX-License-Identifier: MIT
// What a router needs of a server that acts on behalf of another server.
#include "server/relay_server.h"

#include <poll.h>
#include <unistd.h>

#include <array>

#include "tests/client/relay_fixture.h"

namespace mpf::test {
namespace {

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

bool isReadable(int fd) {
  pollfd poll{fd, POLLIN, 0};
  return ::poll(&poll, 1, 0) == 1;
}

TEST_F(RelayTest, AServerThatIsPolledNeedsNoWakeUp) {
  auto& server = startWatched();
  const auto fd = server.descriptor();
  bindByHand();
  server.setPolled(true);
  EXPECT_FALSE(server.receive());
  // What made it readable before it was polled.
  std::array<char, 64> bytes{};
  while (::read(fd, bytes.data(), bytes.size()) > 0) {
  }

  ASSERT_EQ(client_.send(Int32Message({.value = 3})), SendResult::sent);

  EXPECT_FALSE(isReadable(fd));
  EXPECT_EQ(server.reply(server.receive()), ReplyResult::sent);
  static_cast<void>(next());
  server.setPolled(false);
  EXPECT_FALSE(server.receive());
  ASSERT_EQ(client_.send(Int32Message({.value = 3})), SendResult::sent);
  EXPECT_TRUE(isReadable(fd));
  EXPECT_EQ(server.reply(server.receive()), ReplyResult::sent);
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
  EXPECT_TRUE(server.isUnanswered(client, id));
  EXPECT_FALSE(server.isUnanswered(client, id + 1));
  EXPECT_THAT(server.unanswered(client), testing::ElementsAre(id));

  EXPECT_EQ(server.replyTo(client, id, Int32Message({.value = 4})), ReplyResult::sent);
  EXPECT_FALSE(server.isUnanswered(client, id));
  EXPECT_THAT(server.unanswered(client), testing::IsEmpty());
  EXPECT_EQ(server.replyTo(client, id, Int32Message({.value = 5})), ReplyResult::sent);
  EXPECT_EQ(server.replyTo(client + 1, id, Int32Message()), ReplyResult::clientGone);

  const auto first = next();
  const auto second = next();
  EXPECT_TRUE(RelayClient::endsRequest(first));
  EXPECT_FALSE(RelayClient::endsRequest(second));
  EXPECT_EQ(first.tryAs<Int32>()->value, 4);
  EXPECT_EQ(second.tryAs<Int32>()->value, 5);
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
