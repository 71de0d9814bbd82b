// SPDX-License-Identifier: MIT
// MessageClient::sendMany() of values.
#include <array>
#include <span>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

class SendValues : public ClientTest {
 protected:
  static std::vector<Int32> settings(std::int32_t count, std::int32_t first = 0) {
    std::vector<Int32> values;
    for (std::int32_t i = 0; i < count; ++i) values.push_back({.address = -i, .value = first + i});
    return values;
  }
  void startEcho(ServerOptions options = {}) {
    startServer(options).on<Int32>([](Int32&) {});
    bind();
  }
  // The next replies have the values from `first` on.
  void expectReplies(std::int32_t count, std::int32_t first = 0) {
    for (std::int32_t i = 0; i < count; ++i) {
      const auto reply = next();
      const auto* value = reply.tryAs<Int32>();
      ASSERT_NE(value, nullptr);
      ASSERT_EQ(value->value, first + i);
    }
  }
};

TEST_F(SendValues, AreRequestsInOrderWithoutMarks) {
  startServer();
  std::vector<Message> requests;
  server_->on<Int32>([&](Int32Message&& request) { requests.push_back(std::move(request)); });
  bind();
  std::vector<std::uint32_t> ids(20);

  const auto sent = client_.sendMany<Int32>(settings(20), Deadline::never(), ids);

  EXPECT_EQ(sent.count, 20u);
  EXPECT_EQ(sent.result, SendResult::sent);
  runUntil([&] { return requests.size() == 20; });
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(requests[i].tryAs<Int32>()->value, static_cast<std::int32_t>(i));
    EXPECT_EQ(requests[i].tryAs<Int32>()->address, -static_cast<std::int32_t>(i));
    EXPECT_EQ(requests[i].getClientType(), 0);
    EXPECT_EQ(requests[i].getClientExtra(), 0);
    EXPECT_EQ(requests[i].route().requestId, ids[i]);
  }
  for (auto& request : requests) EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  expectReplies(20);
}

TEST_F(SendValues, FillAShorterSpanOfNumbers) {
  startEcho();
  std::array<std::uint32_t, 2> ids{};

  EXPECT_EQ(client_.sendMany<Int32>(settings(5), Deadline::never(), ids).count, 5u);

  for (const auto id : ids) EXPECT_EQ(next().route().requestId, id);
  expectReplies(3, 2);
}

TEST_F(SendValues, MayBeLongerThanASlotHolds) {
  startServer().on<Float64>([](Float64& request) { request.value *= 2; });
  bind();
  const std::vector<Float64> values{{.value = 1.5}, {.value = 2.5}};
  std::array<std::uint32_t, 2> ids{};

  EXPECT_EQ(client_.sendMany<Float64>(values, Deadline::never(), ids).count, 2u);

  for (std::size_t i = 0; i < 2; ++i) {
    const auto reply = next();
    EXPECT_EQ(reply.tryAs<Float64>()->value, 2 * values[i].value);
    EXPECT_EQ(reply.route().requestId, ids[i]);
  }
}

TEST_F(SendValues, StopAtAFullQueue) {
  startEcho({.queueSize = 5});

  auto sent = client_.sendMany<Int32>(settings(8));
  EXPECT_EQ(sent.count, 5u);
  EXPECT_EQ(sent.result, SendResult::queueFull);
  expectReplies(5);
  sent = client_.sendMany<Int32>(settings(3, 5));

  EXPECT_EQ(sent.count, 3u);
  EXPECT_EQ(sent.result, SendResult::sent);
  expectReplies(3, 5);
  EXPECT_THAT(news_, testing::Contains(ConnectStatus::connectQueueFull));
}

TEST_F(SendValues, StopAtTheNumberOfRequestsThatMayBeOutstanding) {
  std::vector<Message> held;
  startServer({.queueSize = 100}).on<Int32>([&](Int32Message&& request) {
    held.push_back(std::move(request));
  });
  bind();
  std::size_t outstanding = 0;
  auto sent = client_.sendMany<Int32>(settings(100));
  while (sent.result == SendResult::sent || sent.result == SendResult::queueFull) {
    outstanding += sent.count;
    ASSERT_LE(outstanding, 10'000u);
    runUntil([&] { return held.size() == outstanding; });
    sent = client_.sendMany<Int32>(settings(100, static_cast<std::int32_t>(outstanding)));
  }
  EXPECT_EQ(sent.result, SendResult::tooManyOutstanding);
  outstanding += sent.count;
  runUntil([&] { return held.size() == outstanding; });

  for (std::size_t i = 0; i < held.size(); ++i)
    EXPECT_EQ(held[i].tryAs<Int32>()->value, static_cast<std::int32_t>(i));
  ASSERT_EQ(server_->replyMany(held).count, outstanding);
  expectReplies(static_cast<std::int32_t>(outstanding));
}

TEST_F(SendValues, NeedAConnection) {
  const auto sent = client_.sendMany<Int32>(settings(2));

  EXPECT_EQ(sent.count, 0u);
  EXPECT_EQ(sent.result, SendResult::notConnected);
}

TEST_F(SendValues, OfNoValuesSendNothing) {
  startEcho();

  const auto sent = client_.sendMany<Int32>({});

  EXPECT_EQ(sent.count, 0u);
  EXPECT_EQ(sent.result, SendResult::sent);
}

TEST_F(SendValues, ThatAreLargerThanTheServerAcceptsAreRefused) {
  startEcho({.maxMessageBytes = sizeof(Int32) - 1});

  EXPECT_EQ(client_.sendMany<Int32>(settings(2)).result, SendResult::tooLarge);
}

TEST_F(SendValues, HaveTheDeadline) {
  startEcho();
  serverRuns_ = false;

  ASSERT_EQ(client_.sendMany<Int32>(settings(3), Deadline::atNs(1)).count, 3u);

  for (int i = 0; i < 3; ++i) EXPECT_EQ(fateOf(next()), Fate::expired);
  serverRuns_ = true;
}

TEST_F(SendValues, HaveAFateWhenTheServerLeaves) {
  startEcho();
  serverRuns_ = false;
  std::array<std::uint32_t, 3> ids{};
  ASSERT_EQ(client_.sendMany<Int32>(settings(3), Deadline::never(), ids).count, 3u);

  server_.reset();

  for (const auto id : ids) {
    const auto fate = next();
    EXPECT_EQ(fateOf(fate), Fate::neverTaken);
    EXPECT_EQ(fate.tryAs<RequestFate>()->requestId, id);
  }
}

TEST_F(SendValues, MayBeCancelled) {
  startEcho();
  serverRuns_ = false;
  std::array<std::uint32_t, 3> ids{};
  ASSERT_EQ(client_.sendMany<Int32>(settings(3), Deadline::never(), ids).count, 3u);

  client_.cancel(ids[1]);

  EXPECT_EQ(fateOf(next()), Fate::cancelled);
  serverRuns_ = true;
  expectReplies(1, 0);
  expectReplies(1, 2);
}

}  // namespace
}  // namespace mpf::test
