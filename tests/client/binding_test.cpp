// SPDX-License-Identifier: MIT
// Bindings: requests that end without a reply: refused, expired, cancelled, lost.
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

TEST_F(ClientTest, ARequestThatTheServerDropsIsRefused) {
  auto& server = startServer();
  server.on<Int32>([](Int32Message&& request) { const Message dropped = std::move(request); });
  bind();
  Int32Message request;
  request.setClientExtra(5);
  ASSERT_EQ(client_.send(std::move(request)), SendResult::sent);

  const auto end = next();

  EXPECT_EQ(fateOf(end), Fate::refused);
  EXPECT_EQ(end.getClientExtra(), 5);
}

TEST_F(ClientTest, ATypeWithoutHandlerIsRefused) {
  startServer().on<Int32>([](Int32&) {});
  bind();
  ASSERT_EQ(client_.send(Float64Message()), SendResult::sent);

  EXPECT_EQ(fateOf(next()), Fate::refused);
}

TEST_F(ClientTest, AFullQueueRefusesImmediatelyAndIsReportedOnce) {
  startServer({.queueSize = 5}).on<Int32>([](Int32&) {});
  bind();
  serverRuns_ = false;
  for (int i = 0; i < 5; ++i) ASSERT_EQ(client_.send(Int32Message({.value = i})), SendResult::sent);

  Int32Message sixth({.value = 6});
  EXPECT_EQ(client_.send(std::move(sixth)), SendResult::queueFull);
  EXPECT_EQ(sixth->value, 6) << "the caller still owns a message that was refused";
  EXPECT_EQ(client_.send(std::move(sixth)), SendResult::queueFull);

  runUntil([&] { return news_.size() == 2; });
  EXPECT_THAT(news_,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectQueueFull));
  serverRuns_ = true;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(next().tryAs<Int32>()->value, i);
  EXPECT_EQ(client_.send(std::move(sixth)), SendResult::sent);
  EXPECT_EQ(next().tryAs<Int32>()->value, 6);
}

TEST_F(ClientTest, AMessageAboveTheLimitIsRefused) {
  startServer({.maxMessageBytes = 1000});
  bind();

  EXPECT_EQ(client_.send(client_.alloc<Char8Array>(961)), SendResult::tooLarge);
}

TEST_F(ClientTest, ARequestThatIsNotReceivedInTimeExpiresOnce) {
  int handled = 0;
  startServer().on<Int32>([&](Int32&) { ++handled; });
  bind();
  serverRuns_ = false;
  std::uint32_t id = 0;
  ASSERT_EQ(client_.send(Int32Message(), Deadline::after(2ms), &id), SendResult::sent);

  const auto end = next();

  EXPECT_EQ(fateOf(end), Fate::expired);
  EXPECT_EQ(end.tryAs<RequestFate>()->requestId, id);
  serverRuns_ = true;
  server_->on<Float64>([](Float64&) {});
  ASSERT_EQ(client_.send(Float64Message()), SendResult::sent);
  EXPECT_NE(next().tryAs<Float64>(), nullptr) << "the server must not receive the expired request";
  EXPECT_EQ(handled, 0);
}

TEST_F(ClientTest, ALateReplyOfACancelledRequestIsNotDelivered) {
  auto& server = startServer();
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  server.on<Float64>([](Float64&) {});
  bind();
  std::uint32_t id = 0;
  ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &id), SendResult::sent);
  runUntil([&] { return static_cast<bool>(held); });

  client_.cancel(id);
  EXPECT_EQ(fateOf(next()), Fate::cancelled);
  EXPECT_EQ(server.reply(std::move(held)), ReplyResult::sent);

  ASSERT_EQ(client_.send(Float64Message()), SendResult::sent);
  EXPECT_NE(next().tryAs<Float64>(), nullptr);
}

// The server identifies a request by its place in a table; a cancelled request keeps its place
// until the server replies.
TEST_F(ClientTest, RepliesToCancelledRequestsAreNotMistakenForLaterOnes) {
  auto& server = startServer({.queueSize = 4});
  std::vector<Message> held;
  server.on<Int32>([&](Int32Message&& request) { held.push_back(std::move(request)); });
  server.on<Float64>([](Float64&) {});
  bind();
  for (int i = 0; i < 2; ++i) {
    std::uint32_t id = 0;
    ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &id), SendResult::sent);
    runUntil([&] { return static_cast<int>(held.size()) == i + 1; });
    client_.cancel(id);
    EXPECT_EQ(fateOf(next()), Fate::cancelled);
    client_.cancel(id);  // has ended: no message follows
  }

  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(client_.send(Float64Message({.value = i + 0.0})), SendResult::sent);
    const auto reply = next();
    ASSERT_NE(reply.tryAs<Float64>(), nullptr)
        << "request " << i << " got the reply to a cancelled one";
    ASSERT_EQ(reply.tryAs<Float64>()->value, i);
  }

  for (auto& request : held) EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent);
  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes));
  for (int i = 0; i < 8; ++i)
    ASSERT_EQ(client_.send(Float64Message()), i < 4 ? SendResult::sent : SendResult::queueFull);
  for (int i = 0; i < 4; ++i) EXPECT_NE(next().tryAs<Float64>(), nullptr);
}

// The server can have only as many requests as may be outstanding, cancelled or not, so that there
// is always room for its first replies.
TEST_F(ClientTest, CancelledRequestsThatTheServerHoldsCountAsOutstanding) {
  auto& server = startServer({.queueSize = 4});
  std::vector<Message> held;
  server.on<Int32>([&](Int32Message&& request) { held.push_back(std::move(request)); });
  bind();
  std::uint32_t id = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &id), SendResult::sent);
    runUntil([&] { return held.size() == i + 1; });
    client_.cancel(id);
    EXPECT_EQ(fateOf(next()), Fate::cancelled);
  }

  EXPECT_EQ(client_.send(Int32Message()), SendResult::tooManyOutstanding);
  held.clear();  // refused

  runUntil(
      [&] { return client_.send(Int32Message(), Deadline::never(), &id) == SendResult::sent; });
  runUntil([&] { return !held.empty(); });
  held.clear();
  EXPECT_EQ(fateOf(next()), Fate::refused);
}

TEST_F(ClientTest, EachRequestOfAServerThatEndsGetsItsFate) {
  startServer();
  auto held = heldRequest();
  serverRuns_ = false;
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);

  server_.reset();

  std::vector<std::optional<Fate>> fates{fateOf(next()), fateOf(next())};
  EXPECT_THAT(fates, testing::UnorderedElementsAre(Fate::outcomeUnknown, Fate::neverTaken));
  runUntil([&] { return !client_.isConnected() && news_.size() == 2; });
  held = Message();  // outlives its server
}
}  // namespace
}  // namespace mpf::test
