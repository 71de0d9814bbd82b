// SPDX-License-Identifier: MIT
// Published messages at their clients: read, changed, kept, sent back and missed.
#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

constexpr std::size_t kElements = 50'000;

class PublishTest : public ClientTest {
 protected:
  Float64ArrayMessage filled(double with) {
    auto message = server_->allocShared<Float64Array>(kElements);
    std::ranges::fill(message.value(), with);
    return message;
  }
  // Publishes an array to the request, and returns what the client gets.
  Message published(const Message& request, double with) {
    EXPECT_EQ(server_->publish(filled(with), request), ReplyResult::sent);
    return next();
  }
  static bool holds(const Message& message, double value) {
    const auto values = message.valueAs<Float64Array>();
    return values.size() == kElements &&
           std::ranges::all_of(values, [value](double one) { return one == value; });
  }
};

TEST_F(PublishTest, AMessageReachesEveryRequestOfAnyClient) {
  startServer();
  std::vector<Message> subscribers;
  server_->on<Int32>([&](Int32Message&& request) { subscribers.push_back(std::move(request)); });
  int received = 0;
  MessageClient other(dispatcher_, [&](const Message& message) {
    if (message.getType() == MessageType::connect) return;
    EXPECT_TRUE(holds(message, 2.5));
    EXPECT_EQ(message.getClientExtra(), 44);
    ++received;
  });
  other.bind("device[0]/a");
  bind();
  runUntil([&] { return other.isConnected(); });
  Int32Message request;
  request.setClientExtra(44);
  ASSERT_EQ(other.send(std::move(request)), SendResult::sent);
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  runUntil([&] { return subscribers.size() == 3; });
  std::vector<ReplyResult> results(3, ReplyResult::noMemory);

  const auto message = filled(2.5);
  EXPECT_EQ(server_->publish(message, subscribers, results), 3u);

  EXPECT_THAT(results, testing::Each(ReplyResult::sent));
  for (int i = 0; i < 2; ++i) {
    const auto mine = next();
    EXPECT_TRUE(holds(mine, 2.5));
    EXPECT_EQ(mine.getMissed(), 0u);
  }
  runUntil([&] { return received == 1; });
  EXPECT_EQ(countNames(backplane_, NameKind::fanOut), 1);
}

TEST_F(PublishTest, AClientMayWriteToItsMessageAndGetsTheNextOneWhole) {
  startServer();
  const auto request = heldRequest();
  {
    auto first = published(request, 1);
    const auto second = published(request, 1);

    std::ranges::fill(first.valueAs<Float64Array>(), -1.0);

    EXPECT_TRUE(holds(first, -1));
    EXPECT_TRUE(holds(second, 1));
  }
  for (int i = 2; i < 20; ++i) {  // the same chunks again
    auto message = published(request, i);
    ASSERT_TRUE(holds(message, i)) << "message " << i;
    std::ranges::fill(message.valueAs<Float64Array>(), -1.0);
  }
  EXPECT_LE(countNames(backplane_, NameKind::fanOut), 4);
}

TEST_F(PublishTest, AClientIsToldWhatItMissed) {
  startServer({.maxBorrowed = 2});
  const auto request = heldRequest();
  {
    const auto one = published(request, 1);
    const auto two = published(request, 2);
    for (int i = 0; i < 7; ++i)
      EXPECT_EQ(server_->publish(filled(3), request), ReplyResult::queueFull);
    EXPECT_TRUE(holds(one, 1) && holds(two, 2));
  }

  EXPECT_EQ(published(request, 4).getMissed(), 7u);
  EXPECT_EQ(published(request, 5).getMissed(), 0u);
}

TEST_F(PublishTest, TheNumberOfMissedMessagesDoesNotHideThatARequestEnds) {
  startServer({.maxBorrowed = 1});
  const auto first = heldRequest();
  std::optional<Message> kept(published(first, 1));
  std::optional<Message> second;
  server_->on<Int32>([&](Int32Message&& request) { second = std::move(request); });
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  runUntil([&] { return second.has_value(); });
  ASSERT_EQ(server_->publish(filled(2), *second), ReplyResult::queueFull);
  kept.reset();

  const auto reply = published(*second, 3);

  EXPECT_EQ(reply.getMissed(), 1u);
  EXPECT_TRUE(RelayClient::endsRequest(reply));
}

TEST_F(PublishTest, AReceivedMessageCanBeSentBackAndOn) {
  startServer();
  const auto request = heldRequest();
  std::optional<Message> back;
  server_->on<Float64Array>([&](Float64ArrayMessage&& array) { back = std::move(array); });

  ASSERT_EQ(client_.send(published(request, 6)), SendResult::sent);
  runUntil([&] { return back.has_value(); });

  EXPECT_TRUE(holds(*back, 6));
  EXPECT_EQ(server_->publish(*back, request), ReplyResult::sent);
  EXPECT_TRUE(holds(next(), 6));
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(holds(published(request, i), i)) << "returned once";
  EXPECT_EQ(protocolErrors(), 0u);
}

TEST_F(PublishTest, ASharedMessageMayAlsoBeAnOrdinaryReply) {
  startServer();
  const auto request = heldRequest();
  auto shared = filled(8);
  shared.setRoute({request.route().link, request.route().requestId, request.route().flags, {}});

  EXPECT_EQ(server_->reply(std::move(shared)), ReplyResult::sent);

  EXPECT_TRUE(holds(next(), 8));
}

TEST_F(PublishTest, AMessageStaysReadableAfterItsClientAndItsServer) {
  startServer();
  const auto request = heldRequest();
  std::optional<MessageClient> other(std::in_place, dispatcher_, [this](Message&& message) {
    if (message.getType() != MessageType::connect) messages_.push_back(std::move(message));
  });
  std::optional<Message> ofOther;
  server_->on<Int32>([&](Int32Message&& one) { ofOther = std::move(one); });
  other->bind("device[0]/a");
  runUntil([&] { return other->isConnected(); });
  ASSERT_EQ(other->send(Int32Message()), SendResult::sent);
  runUntil([&] { return ofOther.has_value(); });
  const auto kept = published(*ofOther, 9);

  other.reset();
  runUntil([&] { return !server_->isClientConnected(*ofOther); });
  for (int i = 0; i < 20; ++i) static_cast<void>(published(request, i));
  EXPECT_TRUE(holds(kept, 9)) << "its chunk was used again";
  server_.reset();
  dispatcher_.runOnce(Deadline::after(1ms));

  EXPECT_TRUE(holds(kept, 9));
  EXPECT_EQ(countNames(backplane_, NameKind::fanOut), 0);
}

TEST_F(PublishTest, SeveralThreadsPublishWhileTheServerReceives) {
  startServer({.maxBorrowed = 64});
  const auto request = heldRequest();
  constexpr int kEach = 200;
  std::atomic<int> published{0};
  const auto publish = [&](double with) {
    for (int i = 0; i < kEach; ++i) {
      const auto message = filled(with);
      // The ring holds fewer messages than both threads publish.
      while (server_->publish(message, request) == ReplyResult::queueFull)
        std::this_thread::yield();
      ++published;
    }
  };

  std::thread one(publish, 1);
  std::thread two(publish, 2);
  int received = 0;
  while (received < 2 * kEach) {
    const auto message = next();
    EXPECT_TRUE(holds(message, 1) || holds(message, 2));
    ++received;
  }
  one.join();
  two.join();

  EXPECT_EQ(published, 2 * kEach);
}

TEST_F(PublishTest, RequestsOfAnotherServerOfTheProcessAreRefused) {
  startServer();
  const auto request = heldRequest();
  MessageServer another(backplane_, "another");

  EXPECT_EQ(another.publish(another.allocShared<Float64Array>(5), request),
            ReplyResult::clientGone);
}

TEST_F(PublishTest, AServerThatEndsLetsItsClientsReceiveWhatItPublished) {
  startServer();
  const auto request = heldRequest();
  ASSERT_EQ(server_->publish(filled(3), request), ReplyResult::sent);
  std::thread ends([server = std::move(server_)]() mutable { server.reset(); });

  runUntil([&] { return !client_.isConnected(); });
  ends.join();

  ASSERT_FALSE(messages_.empty());
  EXPECT_TRUE(holds(messages_.front(), 3));
  messages_.clear();
}

}  // namespace
}  // namespace mpf::test
