// SPDX-License-Identifier: MIT
// MessageClient::onValues(): which replies are delivered together.
#include <poll.h>

#include <array>
#include <cstring>

#include "tests/client/value_runs_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

TEST_F(ValueRuns, ArriveInOrderWithFewCalls) {
  startServer({.queueSize = 256});
  const auto request = heldRequest();

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(100)).count, 100u);
  receive(100);

  expectNumbered();
  for (const auto& run : runs_) EXPECT_LE(run.values.size(), 16u);
  EXPECT_LE(runs_.size(), 10u);
}

TEST_F(ValueRuns, HaveTheMarksOfTheirRequestAndTheFirstOneEndsIt) {
  startServer();
  const auto first = heldRequest();
  const auto request = another(7);

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(20)).count, 20u);
  receive(20);

  for (const auto& run : runs_) {
    EXPECT_EQ(run.clientType, 7);
    EXPECT_EQ(run.clientExtra, -7);
    EXPECT_EQ(run.endsRequest, &run == runs_.data());
  }
  EXPECT_GT(runs_[0].values.size(), 1u) << "the first reply begins a run";
}

TEST_F(ValueRuns, EndAtTheReplyToAnotherRequest) {
  startServer();
  const auto one = heldRequest();
  const auto two = another(0);  // the same marks
  for (const auto* request : {&one, &two}) reply(*request, 0);
  receive(2);
  runs_.clear();

  for (const auto& [request, value] :
       std::to_array<std::pair<const Message*, std::int32_t>>({{&one, 1}, {&one, 2}, {&two, 3}}))
    reply(*request, value);
  receive(5);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(1, 2), ElementsAre(3)));
}

TEST_F(ValueRuns, EndAtAMessageOfAnotherTypeWhichGoesToTheCallback) {
  startServer();
  const auto request = heldRequest();

  reply(request, 1);
  reply(request, 2);
  ASSERT_EQ(server_->reply(server_->allocReplyMessage<Char8Array>(request, 3)), ReplyResult::sent);
  reply(request, 3);
  receive(3);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(1, 2), ElementsAre(3)));
  EXPECT_EQ(runs_[0].otherMessages, 0u);
  EXPECT_EQ(runs_[1].otherMessages, 1u);
  EXPECT_EQ(next().getType(), MessageType::char8Array);
}

TEST_F(ValueRuns, EndWhereTheTimeStampChanges) {
  startServer();
  const auto request = heldRequest();

  for (const std::int64_t stamp : {5, 5, 6})
    reply(request, static_cast<std::int32_t>(stamp), stamp);
  receive(3);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(5, 5), ElementsAre(6)));
  EXPECT_EQ(runs_[0].timeStampNs, 5);
  EXPECT_EQ(runs_[1].timeStampNs, 6);
}

TEST_F(ValueRuns, HaveTheTimeOfTheirSendingIfTheServerStampsReplies) {
  startServer({.stampsReplies = true});
  const auto request = heldRequest();
  const auto startNs = Clock::wallNs();

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(10)).count, 10u);
  const auto sentNs = Clock::wallNs();
  receive(10);

  expectNumbered();
  for (const auto& run : runs_) {
    EXPECT_GE(run.timeStampNs, startNs);
    EXPECT_LE(run.timeStampNs, sentNs);
  }
  // The first value, which ends the request, is sent alone; the others may lie around the end of a
  // batch of slots.
  EXPECT_LE(runs_.size(), 3u);
}

TEST_F(ValueRuns, OfAFullRingArriveInOrderAroundItsEnd) {
  startServer({.queueSize = 2});
  const auto request = heldRequest();
  const auto values = readings(1000);

  for (std::span<const Int32> rest = values; !rest.empty();) {
    rest = rest.subspan(server_->replyMany<Int32>(request, rest).count);
    receive(1000 - rest.size());
  }

  expectNumbered();
}

TEST_F(ValueRuns, CountAsReceivedMessages) {
  startServer({.queueSize = 256});
  const auto request = heldRequest();
  const auto before = sumOf(&layout::WindowControl::received);

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(50)).count, 50u);
  receive(50);

  EXPECT_EQ(sumOf(&layout::WindowControl::received), before + 50);
}

// Longer values than a slot holds come one by one.
TEST_F(ValueRuns, MayBeLong) {
  startServer();
  std::vector<double> numbers;
  MessageClient other(dispatcher_, [](const Message&) {});
  other.onValues<Float64>([&](std::span<const Float64> values, const Message&) {
    for (const auto& value : values) numbers.push_back(value.value);
  });
  Message request;
  server_->on<Int32>([&](Int32Message&& one) { request = std::move(one); });
  other.bind("device[0]/a");
  runUntil([&] { return other.isConnected(); });
  ASSERT_EQ(other.send(Int32Message()), SendResult::sent);
  runUntil([&] { return static_cast<bool>(request); });

  ASSERT_EQ(
      server_->replyMany<Float64>(request, std::vector<Float64>{{.value = 1.5}, {.value = 2.5}})
          .count,
      2u);
  runUntil([&] { return numbers.size() == 2; });

  EXPECT_THAT(numbers, ElementsAre(1.5, 2.5));
}

TEST_F(ValueRuns, DoNotContainInvalidBodies) {
  startServer();
  const auto request = heldRequest();
  reply(request, 1);
  auto message = Message::copyOf(MessageType::int32, std::vector<std::byte>(2));
  message.setRoute(request.route());
  ASSERT_EQ(server_->reply(std::move(message)), ReplyResult::sent);
  reply(request, 2);
  receive(2);

  EXPECT_FALSE(next().isSound());
  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(1), ElementsAre(2)));
}

// Such a body is a valid Int32 in shared memory, which the server may change.
TEST_F(ValueRuns, AreCopiesOfLongerBodies) {
  startServer();
  const auto request = heldRequest();
  std::vector<std::byte> longer(1000);
  const Int32 fields{.value = 5};
  std::memcpy(longer.data(), &fields, sizeof fields);
  auto message = Message::copyOf(MessageType::int32, longer);
  message.setRoute(request.route());
  bool isCopy = false;
  onCall_ = [&](std::span<const Int32> values, const Message& first) {
    isCopy = std::as_bytes(values).data() != first.body().data() && !first.isInline();
  };

  ASSERT_EQ(server_->reply(std::move(message)), ReplyResult::sent);
  receive(1);

  EXPECT_TRUE(isCopy);
  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(5)));
}

TEST_F(ValueRuns, AreTimedOneByOne) {
  startServer();
  const auto request = heldRequest();
  reply(request, 0);
  receive(1);
  pollfd client{dispatcher_.descriptor(), POLLIN, 0};
  while (::poll(&client, 1, 0) == 1) dispatcher_.runPending();  // it sleeps: each reply is timed
  const auto before = timedMessages();

  for (std::int32_t value = 1; value <= 12; ++value) reply(request, value);
  receive(13);

  EXPECT_EQ(timedMessages(), before + 12);
}

TEST_F(ValueRuns, OfAServerThatEndsArriveBeforeTheDisconnect) {
  startServer({.queueSize = 256});
  const auto request = heldRequest();
  ASSERT_EQ(server_->replyMany<Int32>(request, readings(100)).count, 100u);

  server_.reset();
  runUntil([&] { return news_.size() == 2; });

  EXPECT_EQ(received_, 100u);
  expectNumbered();
  for (const auto& run : runs_) EXPECT_EQ(run.news, 1u);
}

}  // namespace
}  // namespace mpf::test
