// SPDX-License-Identifier: MIT
// MessageClient::sendMany() and MessageServer::replyMany() of messages.
#include <poll.h>

#include <array>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

std::vector<Message> numbered(std::int32_t count) {
  std::vector<Message> messages;
  for (std::int32_t i = 0; i < count; ++i) messages.push_back(Int32Message({.value = i}));
  return messages;
}
std::int32_t valueOf(const Message& message) {
  const auto* value = message.tryAs<Int32>();
  return value != nullptr ? value->value : -1;
}

class SendMany : public ClientTest {
 protected:
  // A server that echoes, in order.
  void startEcho(ServerOptions options = {}) {
    startServer(options).on<Int32>([](Int32&) {});
    bind();
  }
};

TEST_F(SendMany, SendsInOrderAndEmptiesTheMessages) {
  startEcho();
  auto messages = numbered(20);
  std::vector<std::uint32_t> ids(20);

  const auto sent = client_.sendMany(messages, Deadline::never(), ids);

  EXPECT_EQ(sent.count, 20u);
  EXPECT_EQ(sent.result, SendResult::sent);
  for (std::int32_t i = 0; i < 20; ++i) {
    EXPECT_FALSE(messages[static_cast<std::size_t>(i)]);
    const auto reply = next();
    EXPECT_EQ(valueOf(reply), i);
    EXPECT_EQ(reply.route().requestId, ids[static_cast<std::size_t>(i)]);
  }
}

TEST_F(SendMany, FillsFewerNumbersThanMessages) {
  startEcho();
  auto messages = numbered(3);
  std::array<std::uint32_t, 2> ids{};

  EXPECT_EQ(client_.sendMany(messages, Deadline::never(), ids).count, 3u);

  for (const auto id : ids) EXPECT_EQ(next().route().requestId, id);
  next();
}

TEST_F(SendMany, StopsAtAFullQueueAndKeepsTheRest) {
  startEcho({.queueSize = 5});
  auto messages = numbered(8);

  auto sent = client_.sendMany(messages);
  EXPECT_EQ(sent.count, 5u);
  EXPECT_EQ(sent.result, SendResult::queueFull);
  for (std::int32_t i = 0; i < 5; ++i) EXPECT_EQ(valueOf(next()), i);

  sent = client_.sendMany(std::span(messages).subspan(5));
  EXPECT_EQ(sent.count, 3u);
  for (std::int32_t i = 5; i < 8; ++i) EXPECT_EQ(valueOf(next()), i);
  EXPECT_THAT(news_, testing::Contains(ConnectStatus::connectQueueFull));
}

TEST_F(SendMany, StopsAtAnEmptyHandle) {
  startEcho();
  auto messages = numbered(3);
  messages[1].reset();

  const auto sent = client_.sendMany(messages);

  EXPECT_EQ(sent.count, 1u);
  EXPECT_EQ(sent.result, SendResult::empty);
  EXPECT_EQ(valueOf(messages[2]), 2);
  EXPECT_EQ(valueOf(next()), 0);
}

TEST_F(SendMany, NeedsAConnection) {
  auto messages = numbered(2);

  const auto sent = client_.sendMany(messages);

  EXPECT_EQ(sent.count, 0u);
  EXPECT_EQ(sent.result, SendResult::notConnected);
  EXPECT_EQ(valueOf(messages[0]), 0);
}

TEST_F(SendMany, GivesEachRequestTheDeadline) {
  startEcho();
  serverRuns_ = false;
  auto messages = numbered(3);

  ASSERT_EQ(client_.sendMany(messages, Deadline::atNs(1)).count, 3u);

  for (int i = 0; i < 3; ++i) EXPECT_EQ(fateOf(next()), Fate::expired);
  serverRuns_ = true;
}

TEST_F(SendMany, LongBodiesArriveAndTheirMemoryIsFreed) {
  startServer().on<Float64Array>([](MessageOf<Float64Array>&) {});
  bind();
  for (int round = 0; round < 50; ++round) {
    std::vector<Message> messages;
    for (std::size_t i = 0; i < 4; ++i) {
      auto array = client_.alloc<Float64Array>(kBeyondRings + i);
      std::ranges::fill(array.value(), static_cast<double>(i));
      messages.push_back(std::move(array));
    }

    ASSERT_EQ(client_.sendMany(messages).count, 4u);

    for (std::size_t i = 0; i < 4; ++i) {
      const auto reply = next();
      const auto values = reply.valueAs<Float64Array>();
      ASSERT_EQ(values.size(), kBeyondRings + i);
      ASSERT_EQ(values.back(), static_cast<double>(i));
    }
  }
}

// Both peers sleep until their descriptor is readable. Between a batch and the look at the
// descriptor no dispatcher runs, so nothing repeats a notice that the batch has left out.
TEST_F(SendMany, ABatchWakesASleepingPeer) {
  std::vector<Message> held;
  startServer().on<Int32>([&](Int32Message&& request) { held.push_back(std::move(request)); });
  bind();
  pollfd server{server_->descriptor(), POLLIN, 0};
  pollfd client{dispatcher_.descriptor(), POLLIN, 0};
  const auto isReadable = [](pollfd& fd) { return ::poll(&fd, 1, 0) == 1; };
  const auto runServer = [&] {
    while (server_->handleOne()) {
    }
  };

  for (int round = 0; round < 3; ++round) {
    while (isReadable(server)) runServer();
    auto messages = numbered(3);
    ASSERT_EQ(client_.sendMany(messages).count, 3u);
    ASSERT_TRUE(isReadable(server));
    runServer();
    ASSERT_EQ(held.size(), 3u);

    while (isReadable(client)) dispatcher_.runPending();
    ASSERT_EQ(server_->replyMany(held).count, 3u);
    ASSERT_TRUE(isReadable(client));
    dispatcher_.runPending();
    EXPECT_EQ(messages_.size(), 3u);
    messages_.clear();
    held.clear();
  }
}

class ReplyMany : public ClientTest {
 protected:
  // Requests that the server has received and keeps, with the values 0, 1, ...
  std::vector<Message> heldRequests(std::int32_t count) {
    const auto held = std::make_shared<std::vector<Message>>();
    server_->on<Int32>([held](Int32Message&& request) { held->push_back(std::move(request)); });
    if (!client_.isConnected()) bind();
    auto messages = numbered(count);
    EXPECT_EQ(client_.sendMany(messages).count, static_cast<std::size_t>(count));
    runUntil([&] { return held->size() == static_cast<std::size_t>(count); });
    return std::move(*held);
  }
};

TEST_F(ReplyMany, SendsInOrderAndEmptiesTheMessages) {
  startServer();
  auto requests = heldRequests(10);

  const auto sent = server_->replyMany(requests);

  EXPECT_EQ(sent.count, 10u);
  EXPECT_EQ(sent.result, ReplyResult::sent);
  for (std::int32_t i = 0; i < 10; ++i) {
    EXPECT_FALSE(requests[static_cast<std::size_t>(i)]);
    EXPECT_EQ(valueOf(next()), i);
  }
}

TEST_F(ReplyMany, ServesSeveralClientsInOneCall) {
  startServer();
  auto requests = heldRequests(3);
  std::vector<Message> others;
  server_->on<Int32>([&](Int32Message&& request) { others.push_back(std::move(request)); });
  std::vector<std::int32_t> received;
  MessageClient other(dispatcher_, [&](const Message& message) {
    if (message.tryAs<Int32>() != nullptr) received.push_back(valueOf(message));
  });
  other.bind("device[0]/a");
  runUntil([&] { return other.isConnected(); });
  auto messages = numbered(2);
  ASSERT_EQ(other.sendMany(messages).count, 2u);
  runUntil([&] { return others.size() == 2; });
  std::vector<Message> replies;
  replies.push_back(std::move(requests[0]));
  replies.push_back(std::move(others[0]));
  replies.push_back(std::move(others[1]));
  replies.push_back(std::move(requests[1]));
  replies.push_back(std::move(requests[2]));

  EXPECT_EQ(server_->replyMany(replies).count, 5u);

  for (std::int32_t i = 0; i < 3; ++i) EXPECT_EQ(valueOf(next()), i);
  runUntil([&] { return received.size() == 2; });
  EXPECT_THAT(received, testing::ElementsAre(0, 1));
}

TEST_F(ReplyMany, StopsAtAFullRingAndKeepsTheRest) {
  startServer({.queueSize = 2});
  const auto request = std::move(heldRequests(1)[0]);
  std::vector<Message> replies;
  for (int i = 0; i < 100; ++i) {
    auto reply = server_->allocReplyMessage<Int32>(request);
    reply->value = i;
    replies.push_back(std::move(reply));
  }

  auto sent = server_->replyMany(replies);

  EXPECT_EQ(sent.result, ReplyResult::queueFull);
  ASSERT_LT(sent.count, 100u);
  EXPECT_EQ(valueOf(replies[sent.count]), static_cast<std::int32_t>(sent.count));
  auto rest = std::span(replies).subspan(sent.count);
  for (std::int32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(valueOf(next()), i);
    rest = rest.subspan(server_->replyMany(rest).count);
  }
  EXPECT_TRUE(rest.empty());
}

TEST_F(ReplyMany, CountsRepliesToAClientThatIsGone) {
  startServer();
  auto requests = heldRequests(1);
  {
    std::vector<Message> others;
    server_->on<Int32>([&](Int32Message&& request) { others.push_back(std::move(request)); });
    MessageClient other(dispatcher_, [](const Message&) {});
    other.bind("device[0]/a");
    runUntil([&] { return other.isConnected(); });
    ASSERT_EQ(other.send(Int32Message()), SendResult::sent);
    runUntil([&] { return !others.empty(); });
    requests.insert(requests.begin(), std::move(others[0]));
  }
  runUntil([&] { return !server_->isClientConnected(requests[0]); });
  requests.insert(requests.begin(), Message());

  const auto sent = server_->replyMany(requests);

  EXPECT_EQ(sent.count, 3u);
  EXPECT_EQ(sent.result, ReplyResult::sent);
  for (const auto& request : requests) EXPECT_FALSE(request);
  EXPECT_EQ(valueOf(next()), 0);
}

}  // namespace
}  // namespace mpf::test
