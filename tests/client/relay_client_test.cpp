// SPDX-License-Identifier: MIT
// What a router needs of a client that acts on behalf of others.
#include "client/relay_client.h"

#include "tests/client/relay_fixture.h"

namespace mpf::test {
namespace {

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

MessageRun int32Run(const std::vector<std::uint32_t>& ids) {
  MessageRun run(MessageType::int32);
  for (const auto id : ids) {
    run.add(EnvelopeWords::of({.requestId = id,
                               .clientType = static_cast<std::int32_t>(id) + 100,
                               .timeNs = 1},  // sendAs() ignores it
                              1, layout::kFirstSlotBodyBytes));
    const Int32 body{.value = static_cast<std::int32_t>(id)};
    run.add(FirstBody::of(reinterpret_cast<const std::byte*>(&body)));
  }
  return run;
}

TEST_F(RelayTest, RequestsOfARunHaveTheirIds) {
  startWatched();
  EXPECT_EQ(client_.sendAs(int32Run({5})), 0u) << "not connected";
  bindByHand();

  EXPECT_EQ(client_.sendAs(int32Run({5, 78, 9})), 3u);

  for (const std::uint32_t id : {5u, 78u, 9u}) {
    auto request = take();
    EXPECT_EQ(request.route().requestId, id);
    EXPECT_EQ(request.tryAs<Int32>()->value, static_cast<std::int32_t>(id));
    EXPECT_TRUE(server_->takeBefore().isNever());
    EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
    const auto reply = next();
    EXPECT_EQ(reply.route().requestId, id);
    EXPECT_EQ(reply.getClientType(), static_cast<std::int32_t>(id) + 100);
  }
}

TEST_F(RelayTest, ARunEndsAtARequestThatCannotBeSent) {
  startWatched();
  bindByHand();
  EXPECT_EQ(client_.sendAs(int32Run({5, 6, 5, 7})), 2u) << "the place of 5 is in use";
  EXPECT_EQ(client_.sendAs(int32Run({7, 8, 9, 10})), 2u) << "the queue has 4 places";

  for (const std::uint32_t id : {5u, 6u, 7u, 8u}) {
    auto request = take();
    EXPECT_EQ(request.route().requestId, id);
    static_cast<void>(server_->reply(std::move(request)));
    EXPECT_EQ(next().route().requestId, id);
  }
  EXPECT_EQ(client_.sendAs(int32Run({9, 10, 11, 12})), 4u) << "their places are free";
  // More often than requests may be outstanding.
  for (int refusals = 0; refusals < 100; ++refusals)
    ASSERT_EQ(client_.sendAs(int32Run({13, 14})), 0u) << "the queue is full";
  for (const std::uint32_t id : {9u, 10u, 11u, 12u}) {
    static_cast<void>(server_->reply(take()));
    EXPECT_EQ(next().route().requestId, id);
  }
  EXPECT_EQ(client_.sendAs(int32Run({13, 14})), 2u);
}

// A client that gets replies together.
class RelayRunReceiverTest : public RelayTest, private RunReceiver {
 protected:
  RelayRunReceiverTest() {
    startWatched();
    client_.setRunReceiver(*this);
    bindByHand();
  }
  // Sends requests, and returns them as the server receives them.
  std::vector<Message> sendRequests(int count) {
    std::vector<Message> requests;
    for (; count != 0; --count) {
      EXPECT_EQ(client_.send(Int32Message({.value = count})), SendResult::sent);
      requests.push_back(take());
    }
    return requests;
  }
  void reply(Message&& message) {
    EXPECT_EQ(server_->reply(std::move(message)), ReplyResult::sent);
  }
  std::size_t room() const noexcept override { return room_; }
  void onRun(const MessageRun& run, bool isFirst) override {
    std::string text = isFirst ? "first" : "further";
    for (std::size_t at = 0; at < run.size(); ++at) {
      text += ' ' + std::to_string(run.message(at).tryAs<Int32>()->value);
      EXPECT_NE(run[at].requestId(), 0u);
    }
    runs_.push_back(text);
  }
  void runAll() {
    while (!dispatcher_.runPending()) {
    }
  }

  std::size_t room_ = 16;
  std::vector<std::string> runs_;
};

TEST_F(RelayRunReceiverTest, GetsFirstRepliesAndFurtherOnes) {
  auto requests = sendRequests(3);
  const auto further = requests[0].duplicate();
  for (auto& request : requests) reply(std::move(request));
  for (int count = 0; count < 2; ++count) reply(further.duplicate());

  runAll();

  EXPECT_THAT(runs_, testing::ElementsAre("first 3 2 1", "further 3 3"));
  EXPECT_THAT(messages_, testing::IsEmpty());
  EXPECT_EQ(client_.send(Int32Message()), SendResult::sent) << "the requests have ended";
}

TEST_F(RelayRunReceiverTest, GetsAsManyAsItHasRoomFor) {
  room_ = 2;
  for (auto& request : sendRequests(3)) reply(std::move(request));
  runAll();
  EXPECT_THAT(runs_, testing::ElementsAre("first 3 2"));
  EXPECT_THAT(messages_, testing::SizeIs(1));

  room_ = 1;
  for (auto& request : sendRequests(3)) reply(std::move(request));
  runAll();
  EXPECT_THAT(std::exchange(messages_, {}), testing::SizeIs(4));
}

TEST_F(RelayRunReceiverTest, GetsNoReplyToARequestThatHasHadItsFate) {
  auto requests = sendRequests(3);
  client_.cancel(requests[1].route().requestId);
  for (auto& request : requests) reply(std::move(request));

  runAll();

  EXPECT_THAT(runs_, testing::IsEmpty());
  ASSERT_THAT(messages_, testing::SizeIs(3));
  EXPECT_EQ(messages_[0].getType(), MessageType::requestFate);
  EXPECT_EQ(messages_[1].tryAs<Int32>()->value, 3);
  EXPECT_EQ(messages_[2].tryAs<Int32>()->value, 1);
  messages_.clear();
}

// Other clients of the dispatcher have their turn after at most 15 more messages than without runs.
TEST_F(RelayRunReceiverTest, GetsOneLongRunInATurn) {
  const auto request = std::move(sendRequests(1).front());
  const auto further = request.duplicate();
  std::vector<Message> replies;
  for (int count = 0; count < 20; ++count) replies.push_back(further.duplicate());
  for (auto& message : replies) reply(std::move(message));

  std::size_t most = 0;
  for (bool isDone = false; !isDone;) {
    runs_.clear();
    isDone = dispatcher_.runPending(1);
    std::size_t values = 0;
    for (const auto& run : runs_) values += static_cast<std::size_t>(std::ranges::count(run, '1'));
    most = std::max(most, values);
  }

  EXPECT_GE(most, 2u);
  EXPECT_LE(most, 17u);
  messages_.clear();
}

// A far router would close the connection, which other clients use, too.
TEST_F(RelayRunReceiverTest, GetsNoFurtherReplyBeforeTheFirstOne) {
  auto request = std::move(sendRequests(1).front());
  const auto client = server_->clientOf(request);
  const auto further = request.duplicate();
  reply(std::move(request));
  std::uint32_t id = 0;
  ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &id), SendResult::sent);
  for (int count = 0; count < 2; ++count) reply(further.duplicate());
  ASSERT_EQ(server_->replyTo(client, id, Int32Message()), ReplyResult::sent);

  runUntil([&] { return news_.size() == 2; });

  EXPECT_EQ(client_.notConnectedBecause(), "the server sent invalid data");
  EXPECT_THAT(runs_, testing::ElementsAre("further 1 1"));
  ASSERT_THAT(messages_, testing::SizeIs(2));
  EXPECT_EQ(messages_[0].tryAs<Int32>()->value, 1);
  EXPECT_EQ(fateOf(messages_[1]), Fate::outcomeUnknown);
  messages_.clear();
}

TEST_F(RelayRunReceiverTest, GetsOnlyTypesThatFillASlot) {
  auto requests = sendRequests(2);
  for (auto& request : requests) {
    auto answer = server_->allocReplyMessage<Float64>(request);
    reply(std::move(answer));
  }

  runAll();

  EXPECT_THAT(runs_, testing::IsEmpty());
  EXPECT_THAT(std::exchange(messages_, {}), testing::SizeIs(2));
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

}  // namespace
}  // namespace mpf::test
