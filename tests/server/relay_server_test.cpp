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

// Requests that are received together.
class RelayRunTest : public RelayTest {
 protected:
  RelayRunTest() {
    startWatched(128);  // a run ends with a batch of the ring: 16 slots for this queue size
    bindByHand();
  }
  void sendValues(std::int32_t first, std::int32_t count) {
    for (auto value = first; value < first + count; ++value) {
      Int32Message message({.value = value});
      message.setClientType(value + 100);
      message.setClientExtra(-value);
      ASSERT_EQ(client_.send(std::move(message)), SendResult::sent);
    }
  }
  // Receives requests; those of a run are in run_, and their client in sender_.
  Message receive(std::size_t most = MessageRun::kMost) {
    sender_ = 0;
    return server_->receive(run_, sender_, most);
  }

  MessageRun run_;
  std::uint64_t sender_ = 0;
};

TEST_F(RelayRunTest, ReceivesRequestsThatWaitTogether) {
  sendValues(1, 3);

  EXPECT_FALSE(receive());

  ASSERT_EQ(run_.size(), 3u);
  EXPECT_EQ(comings_, (std::vector{std::pair(sender_, true)}));
  for (std::int32_t at = 0; at < 3; ++at) {
    const auto message = run_.message(static_cast<std::size_t>(at));
    EXPECT_EQ(message.tryAs<Int32>()->value, at + 1);
    EXPECT_EQ(message.getClientType(), at + 101);
    EXPECT_EQ(message.getClientExtra(), -at - 1);
    EXPECT_TRUE(server_->isUnanswered(sender_, run_[static_cast<std::size_t>(at)].requestId()));
  }
  server_->refuse(sender_, run_);
  for (std::int32_t at = 0; at < 3; ++at) {
    const auto message = next();
    EXPECT_EQ(message.tryAs<RequestFate>()->fate, Fate::refused);
    EXPECT_EQ(message.getClientType(), at + 101);
  }
}

TEST_F(RelayRunTest, TakesAtMostAsManyAsAsked) {
  sendValues(1, 4);

  const auto one = receive(1);
  EXPECT_TRUE(one);
  EXPECT_EQ(sender_, 0u);
  EXPECT_FALSE(receive(2));
  EXPECT_EQ(run_.size(), 2u);
  EXPECT_TRUE(receive()) << "the last one is alone";
  EXPECT_FALSE(receive());
  EXPECT_EQ(sender_, 0u);
  server_->refuse(sender_, run_);  // of no client
}

TEST_F(RelayRunTest, ARequestWithADeadlineComesAlone) {
  sendValues(1, 1);
  ASSERT_EQ(client_.send(Int32Message({.value = 2}), Deadline::after(1h)), SendResult::sent);

  EXPECT_FALSE(receive());
  EXPECT_EQ(run_.size(), 1u);
  EXPECT_TRUE(receive());
  EXPECT_FALSE(server_->takeBefore().isNever());
}

TEST_F(RelayRunTest, RepliesToSeveralRequests) {
  sendValues(1, 4);
  EXPECT_FALSE(receive());
  ASSERT_EQ(run_.size(), 4u);
  const auto last = run_[3].requestId();
  ASSERT_EQ(server_->replyTo(sender_, last, Int32Message({.value = 40})), ReplyResult::sent);

  EXPECT_EQ(server_->replyTo(sender_, run_, true), 3u) << "the last one has had its first reply";
  EXPECT_EQ(server_->replyTo(sender_, run_, true), 0u);
  EXPECT_EQ(server_->replyTo(sender_ + 1, run_, true), 0u) << "another client";
  EXPECT_EQ(server_->replyTo(0, run_, true), 0u);

  EXPECT_EQ(next().tryAs<Int32>()->value, 40);
  for (std::int32_t value = 1; value <= 3; ++value) {
    const auto reply = next();
    EXPECT_TRUE(RelayClient::endsRequest(reply));
    EXPECT_EQ(reply.tryAs<Int32>()->value, value);
    EXPECT_EQ(reply.getClientType(), value + 100);
    EXPECT_EQ(reply.getClientExtra(), -value);
  }
  EXPECT_THAT(server_->unanswered(sender_), testing::IsEmpty());
}

TEST_F(RelayRunTest, FurtherRepliesLeaveRoomForFirstOnes) {
  sendValues(1, 2);
  EXPECT_FALSE(receive());
  ASSERT_EQ(run_.size(), 2u);
  EXPECT_EQ(server_->replyTo(sender_, run_, false), 0u) << "before the first replies";
  ASSERT_EQ(server_->replyTo(sender_, run_, true), 2u);
  const auto answered = run_;
  sendValues(3, 4);
  EXPECT_FALSE(receive());

  std::size_t further = 0;
  while (const auto sent = server_->replyTo(sender_, answered, false)) further += sent;

  EXPECT_GT(further, 2u);
  EXPECT_EQ(server_->replyTo(sender_, run_, true), run_.size()) << "the queue is full";
  for (std::size_t at = 0; at < 2 + further + run_.size(); ++at)
    EXPECT_EQ(RelayClient::endsRequest(next()), at < 2 || at >= 2 + further) << at;
}

// The time stamps come from the far server.
TEST_F(RelayRunTest, RepliesHaveTheTimeStampsThatTheyAreGiven) {
  sendValues(1, 2);
  EXPECT_FALSE(receive());
  ASSERT_EQ(run_.size(), 2u);
  MessageRun replies(MessageType::int32);
  for (std::size_t at = 0; at < 2; ++at) {
    auto words = run_[at];
    words.timeNs = 1000 + at;
    replies.add(words);
    replies.add(FirstBody{});
  }

  ASSERT_EQ(server_->replyTo(sender_, replies, true), 2u);

  EXPECT_EQ(next().getTimeStampNs(), 1000);
  EXPECT_EQ(next().getTimeStampNs(), 1001);
}

// A message that counts missed ones is in the fan-out pool, of which only the server removes files.
TEST_F(RelayTest, AServerThatHasClosedWaitsForNoClientWhileItsPoolsAreKept) {
  constexpr std::size_t kImageBytes = 100'000;
  auto& server = startWatched();
  bindByHand();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  auto request = take();
  const auto client = server.clientOf(request);
  const auto id = request.route().requestId;
  ASSERT_EQ(server.reply(std::move(request)), ReplyResult::sent);
  auto image = Char8ArrayMessage::inBuffer(
      allocateHeapBody(Char8ArrayMessage::bytesFor(kImageBytes)), kImageBytes);
  image.setRoute({0, 0, Message::missedFlags(5), nullptr});
  ASSERT_EQ(server.replyTo(client, id, std::move(image)), ReplyResult::sent);

  auto pools = server.closeAll();
  server_.reset();

  EXPECT_NE(pools, nullptr);
  static_cast<void>(next());
  {
    const auto received = next();
    EXPECT_EQ(received.getMissed(), 5u);
    EXPECT_GE(received.body().size(), kImageBytes);
  }
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
