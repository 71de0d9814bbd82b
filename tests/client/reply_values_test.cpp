// SPDX-License-Identifier: MIT
// MessageServer::replyMany() of values.
#include <poll.h>

#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

class ReplyManyValues : public ClientTest {
 protected:
  static std::vector<Int32> readings(std::int32_t count) {
    std::vector<Int32> values;
    for (std::int32_t i = 0; i < count; ++i) values.push_back({.value = i});
    return values;
  }
  static std::int32_t valueOf(const Message& message) {
    const auto* value = message.tryAs<Int32>();
    return value != nullptr ? value->value : -1;
  }
};

TEST_F(ReplyManyValues, AreRepliesToTheRequestAndTheFirstOneEndsIt) {
  startServer();
  const auto request = [&] {
    auto held = std::make_shared<Message>();
    server_->on<Int32>([held](Int32Message&& one) { *held = std::move(one); });
    bind();
    Int32Message message;
    message.setClientType(7);
    message.setClientExtra(-8);
    EXPECT_EQ(client_.send(std::move(message)), SendResult::sent);
    runUntil([&] { return static_cast<bool>(*held); });
    return std::move(*held);
  }();

  const auto sent = server_->replyMany<Int32>(request, readings(20));

  EXPECT_EQ(sent.count, 20u);
  EXPECT_EQ(sent.result, ReplyResult::sent);
  for (std::int32_t i = 0; i < 20; ++i) {
    const auto reply = next();
    EXPECT_EQ(valueOf(reply), i);
    EXPECT_EQ(reply.getClientType(), 7);
    EXPECT_EQ(reply.getClientExtra(), -8);
    EXPECT_EQ(reply.route().requestId, request.route().requestId);
    EXPECT_EQ((reply.route().flags & kEndsRequest) != 0, i == 0);
  }
}

TEST_F(ReplyManyValues, MayBeLongerThanASlotHolds) {
  startServer();
  const auto request = heldRequest();
  const std::vector<Float64> values{{.value = 1.5}, {.value = 2.5}, {.value = 3.5}};

  ASSERT_EQ(server_->replyMany<Float64>(request, values).count, 3u);

  for (const auto& value : values) EXPECT_EQ(next().tryAs<Float64>()->value, value.value);
}

// Also when the request has ended, so that only values that fill a slot are left.
TEST_F(ReplyManyValues, AreRefusedIfTheyAreLongerThanTheServerAllows) {
  startServer({.maxMessageBytes = sizeof(Int32) - 1});
  Message request;
  server_->on<SerialConfig>([&](SerialConfigMessage&& one) { request = std::move(one); });
  bind();
  ASSERT_EQ(client_.send(SerialConfigMessage()), SendResult::sent);
  runUntil([&] { return static_cast<bool>(request); });

  for (const bool isEnded : {false, true}) {
    const auto sent = server_->replyMany<Int32>(request, readings(2));
    EXPECT_EQ(sent.count, 0u) << isEnded;
    EXPECT_EQ(sent.result, ReplyResult::tooLarge) << isEnded;
    const std::array<SerialConfig, 1> allowed{};
    ASSERT_EQ(server_->replyMany<SerialConfig>(request, allowed).count, 1u);
    EXPECT_EQ(next().getType(), MessageType::serialConfig);
  }
}

// Near its end a full ring has no room for both slots of a Float64, and the body goes into a chunk:
// a new one, although the values themselves lie in one that could be sent.
TEST_F(ReplyManyValues, StayWithTheCallerIfTheyLieInAChunk) {
  startServer({.queueSize = 2});
  const auto request = heldRequest();
  constexpr std::size_t kValues = 200;
  auto memory = server_->allocReplyMessage<User>(request, kValues * sizeof(Float64));
  std::vector<Float64> numbers(kValues);
  for (std::size_t i = 0; i < kValues; ++i) numbers[i].value = static_cast<double>(i);
  std::memcpy(memory.value().data(), numbers.data(), memory.value().size_bytes());
  std::span<const Float64> rest{reinterpret_cast<const Float64*>(memory.value().data()), kValues};
  ASSERT_EQ(server_->reply(server_->allocReplyMessage<Int32>(request)), ReplyResult::sent);
  next();  // it has one slot, so that one may be left

  for (std::size_t i = 0; i < kValues; ++i) {
    const auto sent = server_->replyMany<Float64>(request, rest);
    ASSERT_TRUE(sent.result == ReplyResult::sent || sent.result == ReplyResult::queueFull);
    rest = rest.subspan(sent.count);
    ASSERT_EQ(next().tryAs<Float64>()->value, static_cast<double>(i));
  }
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(server_->reply(std::move(memory)), ReplyResult::sent) << "the memory is still ours";
  EXPECT_EQ(next().getType(), MessageType::user);
}

TEST_F(ReplyManyValues, StopAtAFullRing) {
  startServer({.queueSize = 2});
  const auto request = heldRequest();
  const auto values = readings(100);

  auto sent = server_->replyMany<Int32>(request, values);

  EXPECT_EQ(sent.result, ReplyResult::queueFull);
  ASSERT_LT(sent.count, 100u);
  auto rest = std::span(values).subspan(sent.count);
  for (std::int32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(valueOf(next()), i);
    sent = server_->replyMany<Int32>(request, rest);
    rest = rest.subspan(sent.count);
  }
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(sent.result, ReplyResult::sent) << "none was left";
}

// The lock of the connection is released after each 1024.
TEST_F(ReplyManyValues, OfManyRunsArriveInOrder) {
  startServer({.queueSize = 8192});
  const auto request = heldRequest();

  const auto sent = server_->replyMany<Int32>(request, readings(3000));

  ASSERT_EQ(sent.count, 3000u);
  EXPECT_EQ(sent.result, ReplyResult::sent);
  for (std::int32_t i = 0; i < 3000; ++i) ASSERT_EQ(valueOf(next()), i);
}

TEST_F(ReplyManyValues, StopWhenTheClientIsGone) {
  startServer();
  Message request;
  const Message empty;
  server_->on<Int32>([&](Int32Message&& one) { request = std::move(one); });
  {
    MessageClient other(dispatcher_, [](const Message&) {});
    other.bind("device[0]/a");
    runUntil([&] { return other.isConnected(); });
    ASSERT_EQ(other.send(Int32Message()), SendResult::sent);
    runUntil([&] { return static_cast<bool>(request); });
  }
  runUntil([&] { return server_->clientOf(request) == 0; });

  for (const Message* gone : std::to_array<const Message*>({&request, &empty})) {
    const auto sent = server_->replyMany<Int32>(*gone, readings(3));
    EXPECT_EQ(sent.count, 0u);
    EXPECT_EQ(sent.result, ReplyResult::clientGone);
  }
}

TEST_F(ReplyManyValues, HaveATimeStampIfRepliesHaveOne) {
  startServer({.stampsReplies = true});
  const auto request = heldRequest();
  const auto before = Clock::wallNs();

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(3)).count, 3u);

  for (int i = 0; i < 3; ++i) EXPECT_GE(next().getTimeStampNs(), before);
}

TEST_F(ReplyManyValues, WakeASleepingClient) {
  startServer();
  const auto request = heldRequest();
  pollfd client{dispatcher_.descriptor(), POLLIN, 0};
  for (int round = 0; round < 3; ++round) {
    while (::poll(&client, 1, 0) == 1) dispatcher_.runPending();

    ASSERT_EQ(server_->replyMany<Int32>(request, readings(3)).count, 3u);

    ASSERT_EQ(::poll(&client, 1, 0), 1);
    dispatcher_.runPending();
    EXPECT_EQ(messages_.size(), 3u);
    messages_.clear();
  }
}

TEST_F(ReplyManyValues, OfNoneSendNothing) {
  startServer();
  const auto request = heldRequest();

  const auto sent = server_->replyMany<Int32>(request, {});

  EXPECT_EQ(sent.count, 0u);
  EXPECT_EQ(sent.result, ReplyResult::sent);
  EXPECT_EQ(server_->reply(server_->allocReplyMessage<Int32>(request)), ReplyResult::sent);
  EXPECT_TRUE((next().route().flags & kEndsRequest) != 0) << "it was still unanswered";
}

// The values fill the first ring of replies, and go on in the second one.
TEST_F(ReplyManyValues, LeaveRoomForTheFirstReplies) {
  startServer();
  const auto subscriber = heldRequest();
  std::vector<Message> held;
  server_->on<Int32>([&](Int32Message&& request) { held.push_back(std::move(request)); });
  const auto values = readings(100);
  ASSERT_EQ(client_.sendMany<Int32>(values).count, 100u);
  while (server_->handleOne()) {
  }
  ASSERT_EQ(held.size(), 100u);

  const auto sent = server_->replyMany<Int32>(subscriber, readings(1000));

  EXPECT_EQ(sent.result, ReplyResult::queueFull);
  for (auto& request : held) ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  for (std::size_t i = 0; i < sent.count + 100; ++i) next();
}

}  // namespace
}  // namespace mpf::test
