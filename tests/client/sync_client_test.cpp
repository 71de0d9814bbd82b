// SPDX-License-Identifier: MIT
#include <mpf/sync_client.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <gtest/gtest.h>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <mpf/message_server.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

// A client whose request a server has answered and keeps; then nobody runs the server.
struct Subscription {
  void reply() {
    ASSERT_EQ(server.reply(server.allocReplyMessage<Int32>(held)), ReplyResult::sent);
  }
  Subscription() {
    server.on<Int32>([&](Int32Message&& request) {
      static_cast<void>(server.reply(server.allocReplyMessage<Int32>(request)));
      held = std::move(request);
    });
    std::thread thread([&] { server.run(); });
    EXPECT_TRUE(client.call(Int32Message(), 60s));
    server.interrupt();
    thread.join();
  }

  TestBackplane backplane;
  MessageServer server{backplane, "device"};
  Message held;
  SyncClient client{backplane, "device"};
};

TEST(SyncClientTest, ReturnsMessagesThatHaveArrivedWithoutWaiting) {
  Subscription subscription;
  EXPECT_FALSE(subscription.client.receive(0s));

  subscription.reply();

  EXPECT_TRUE(subscription.client.receive(0s));
  EXPECT_FALSE(subscription.client.receive(0s));
}

// The client calls another request, and never receive().
TEST(SyncClientTest, DropsTheOldestOfTooManyStoredMessages) {
  constexpr std::int32_t kMore = 10;
  Subscription subscription;
  auto& [backplane, server, held, client] = subscription;
  const auto storeSome = [&](std::size_t most, const auto& make) {
    constexpr std::size_t kBatch = 32;  // fits into the ring
    for (std::size_t sent = 0; sent < most + kMore;) {
      for (std::size_t i = 0; i < kBatch && sent < most + kMore; ++i, ++sent)
        ASSERT_EQ(server.reply(make(static_cast<std::int32_t>(sent))), ReplyResult::sent);
      EXPECT_FALSE(client.call(Int32Message(), 1ns));
      EXPECT_FALSE(server.receive()) << "the request has expired";
    }
  };

  storeSome(SyncClient::kMaxStored, [&](std::int32_t number) {
    auto reply = server.allocReplyMessage<Int32>(held);
    reply->value = number;
    return reply;
  });

  EXPECT_EQ(client.dropped(), kMore);
  const auto oldest = MessageOf<Int32>::tryFrom(client.receive(0s));
  ASSERT_TRUE(oldest);
  EXPECT_EQ((*oldest)->value, kMore);
  while (client.receive(0s)) {
  }
  storeSome(SyncClient::kMaxStoredLong,
            [&](std::int32_t) { return server.allocReplyMessage<Float64Array>(held, 1000); });
  EXPECT_EQ(client.dropped(), 2 * kMore);
}

// A subscription whose client has used all ids since.
TEST(SyncClientTest, AFurtherReplyWithTheIdOfARequestIsNoAnswer) {
  Subscription subscription;
  auto further = subscription.server.allocReplyMessage<Int32>(subscription.held);
  auto route = further.route();
  ++route.requestId;  // that of the next request
  further.setRoute(route);
  ASSERT_EQ(subscription.server.reply(std::move(further)), ReplyResult::sent);

  EXPECT_EQ(subscription.client.call(Int32Message(), 0s).fate(), Fate::expired);

  EXPECT_TRUE(subscription.client.receive(0s));
}

// The dispatcher looks at deadlines only after some messages of a busy link.
TEST(SyncClientTest, ARequestExpiresBesideFurtherReplies) {
  Subscription subscription;
  for (int i = 0; i < 30; ++i) subscription.reply();

  EXPECT_EQ(subscription.client.call(Int32Message(), 0s).fate(), Fate::expired);
}

TEST(SyncClientTest, ReportsWhyThereIsNoReply) {
  const Watchdog watchdog("sync client");
  const TestBackplane backplane;
  SyncClient client(backplane, "echo");
  auto none = client.call(Int32Message(), 1ms);
  EXPECT_EQ(none.refusal(), SendResult::notConnected);
  EXPECT_EQ(none.why(), "not sent: not connected: server \"echo\" at location 0 is not running");

  MessageServer server(backplane, "echo");
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  std::thread serving([&] { server.run(); });
  ASSERT_TRUE(client.connectWait(60s));
  // `expired` when the server had no processor in that time.
  auto patience = 50ms;
  auto unknown = client.call(Int32Message(), patience);
  for (; unknown.fate() == Fate::expired; unknown = client.call(Int32Message(), patience))
    patience *= 2;
  server.interrupt();
  serving.join();
  auto expired = client.call(Int32Message(), 5ms);

  EXPECT_EQ(unknown.fate(), Fate::outcomeUnknown);
  EXPECT_EQ(expired.fate(), Fate::expired);
  EXPECT_THAT(unknown.why(), testing::StartsWith("no reply within "));
  EXPECT_EQ(expired.why(),
            "no reply: expired (the server did not take the request in time: nothing was done)");
}

TEST(SyncClientTest, SaysThatTheReplyIsOfAnotherType) {
  const Watchdog watchdog("sync client");
  Answer answer(Float64Message({.value = 1}));
  EXPECT_EQ(answer.why(), "");

  EXPECT_FALSE(answer.as<Int32>());

  EXPECT_EQ(answer.why(), "the reply is of type float64, not int32");
  EXPECT_TRUE(answer.as<Float64>());
  EXPECT_EQ(answer.why(), "");
}

TEST(SyncClientTest, SaysWhyTheServerRepliedWithText) {
  constexpr std::string_view kText = "no range\x1b";
  auto reply = Char8ArrayMessage::allocValue(kText.size());
  reply->status = -7;
  std::ranges::copy(kText, reply.value().begin());
  Answer answer(std::move(reply));

  EXPECT_FALSE(answer.as<Int32>());

  EXPECT_EQ(answer.why(),
            "the reply is of type char8Array, not int32; it has status -7: \"no range\\x1b\"");
}

// Servers that end and are replaced while clients call: each request is executed exactly once.
TEST(SyncClientTest, SendsAgainWhatNoServerHasTaken) {
  constexpr std::size_t kServers = 100;
  const Watchdog watchdog("sync client");
  const TestBackplane backplane;
  std::atomic<bool> isOver{false};
  std::atomic<bool> haveClientsEnded{false};
  std::vector<int> executed;  // by the servers, of which one runs at a time
  // A server that ends when `hasEnough` is true, perhaps while requests wait.
  const auto serve = [&](const auto& hasEnough) {
    MessageServer server(backplane, "counter");
    while (!hasEnough()) {
      server.waitForMessage(Deadline::after(10ms));
      if (auto request = server.receive()) {
        executed.push_back(request.tryAs<Int32>()->value);
        EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent);
      }
    }
  };
  std::thread servers([&] {
    for (std::size_t i = 1; i <= kServers; ++i)
      serve([&, enough = executed.size() + 20 + i] { return executed.size() >= enough; });
    isOver = true;
    serve([&] { return haveClientsEnded.load(); });
  });

  std::array<int, 4> called{};
  std::vector<std::thread> clients;
  for (int thread = 0; thread < 4; ++thread) {
    clients.emplace_back([&, thread] {
      SyncClient client(backplane, "counter");
      for (int& i = called[static_cast<std::size_t>(thread)]; !isOver; ++i) {
        const auto value = thread * 1'000'000 + i;
        auto answer = client.call(Int32Message({.value = value}), 900s, Retry::neverTaken);
        const auto reply = answer.as<Int32>();
        ASSERT_TRUE(reply) << answer.why();
        ASSERT_EQ((*reply)->value, value);
      }
    });
  }
  for (auto& client : clients) client.join();
  haveClientsEnded = true;
  servers.join();

  std::sort(executed.begin(), executed.end());
  std::vector<int> expected;
  for (int thread = 0; thread < 4; ++thread)
    for (int i = 0; i < called[static_cast<std::size_t>(thread)]; ++i)
      expected.push_back(thread * 1'000'000 + i);
  EXPECT_EQ(executed, expected);
  EXPECT_GT(executed.size(), 7000U);
}

}  // namespace
}  // namespace mpf::test
