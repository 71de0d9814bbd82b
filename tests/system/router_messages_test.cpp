// SPDX-License-Identifier: MIT
// Messages through two routers: every type unchanged in both directions, any number of replies,
// fates and notifications in order.
#include <bit>
#include <capnp/message.h>
#include <capnp/serialize.h>
#include <cstring>
#include <limits>

#include "schema/conversion.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

class RouterMessagesTest : public RouterTest {
 protected:
  void SetUp() override { startAll(); }

  // Sends a message and expects its echo, with every byte unchanged.
  void expectEcho(Message message) {
    message.setClientType(-77);
    message.setClientExtra(std::numeric_limits<std::int32_t>::min());
    const auto sent = message.duplicate();
    const auto id = caller_->send(std::move(message));
    Message seen;
    serve_ = [&](Message&& request) {
      seen = request.duplicate();
      static_cast<void>(server_->reply(std::move(request)));
    };
    const auto reply = next();
    expectSame(seen, sent);
    expectSame(reply, sent);
    EXPECT_EQ(reply.getClientType(), -77);
    EXPECT_EQ(reply.getClientExtra(), std::numeric_limits<std::int32_t>::min());
    EXPECT_EQ(reply.route().requestId, id);
  }
  static void expectSame(const Message& one, const Message& other) {
    ASSERT_EQ(one.getType(), other.getType());
    ASSERT_EQ(one.body().size(), other.body().size()) << toString(one.getType());
    EXPECT_EQ(std::memcmp(one.body().data(), other.body().data(), one.body().size()), 0)
        << toString(one.getType());
  }
  template <class T, class Fill>
  Message array(std::size_t length, Fill fill) {
    auto message = caller_->client.alloc<T>(length);
    for (std::size_t at = 0; at < length; ++at) message.value()[at] = fill(at);
    return message;
  }
};

constexpr auto kLeast = std::numeric_limits<std::int32_t>::min();
constexpr auto kMost = std::numeric_limits<std::int32_t>::max();

TEST_F(RouterMessagesTest, IntegersAreUnchanged) {
  expectEcho(Int32Message(
      {.timeout = kLeast, .cmd = kMost, .status = -1, .address = 1, .extra = 0, .value = kLeast}));
  expectEcho(OutOfBandMessage(
      {.timeout = 1, .cmd = 2, .status = 3, .address = 4, .extra = 5, .value = kMost}));
  expectEcho(SerialConfigMessage(
      {.baud = 115'200, .stopBits = 2, .bitsPerChar = 7, .parity = 'E', .flowControl = 'H'}));
}

// Compares bits, not values.
TEST_F(RouterMessagesTest, FloatsAreUnchangedInEveryBit) {
  using Limits = std::numeric_limits<double>;
  const std::vector<double> all{0.0, -0.0, 1.0 / 3, Limits::infinity(), -Limits::infinity(),
                                Limits::denorm_min(), Limits::max(),
                                // a quiet NaN with something in it
                                std::bit_cast<double>(0x7ff8'0000'dead'beefull),
                                // a signalling one
                                std::bit_cast<double>(0xfff0'0000'0000'0001ull)};
  for (const auto value : all)
    expectEcho(Float64Message(
        {.timeout = 1, .cmd = 2, .status = -3, .address = 4, .extra = 5, .value = value}));
  expectEcho(array<Float64Array>(all.size(), [&](std::size_t at) { return all[at]; }));
}

TEST_F(RouterMessagesTest, ArraysOfAnyLengthAreUnchanged) {
  for (const std::size_t length : {0u, 1u, 2u, 7u, 1000u, 300'000u}) {
    expectEcho(array<Int32Array>(
        length, [](std::size_t at) { return static_cast<std::int32_t>(at * 2'654'435'761u); }));
    expectEcho(
        array<Float64Array>(length, [](std::size_t at) { return 1.0 / static_cast<double>(at); }));
    expectEcho(
        array<Char8Array>(length, [](std::size_t at) { return static_cast<char>(at * 37); }));
  }
}

TEST_F(RouterMessagesTest, BytesKeepTheirEndOfMessageAndTheirCounts) {
  for (const std::string_view eom : {"", "\n", "\r\n", "\0\0\xff", "abcd"}) {
    auto message = caller_->client.alloc<Char8Array>(5);
    message->timeout = 3;
    message->numberRetrys = kLeast;
    message->eomLen = static_cast<std::int32_t>(eom.size());
    eom.copy(message->eomString.data(), eom.size());
    std::memcpy(message.value().data(), "a\0b\xff", 5);
    expectEcho(std::move(message));
  }
}

// The router does not interpret the struct: even the order of its words in the segment is
// unchanged.
TEST_F(RouterMessagesTest, AUserDefinedStructIsUnchanged) {
  for (const std::size_t words : {1u, 2u, 1000u}) {
    expectEcho(
        array<User>(8 * words, [&](std::size_t at) { return static_cast<std::byte>(at * 97); }));
  }
}

TEST_F(RouterMessagesTest, RequestsOfOneClientArriveInOrder) {
  constexpr int kRequests = 3000;
  int arrived = 0;
  int answered = 0;
  serve_ = [&](Message&& request) {
    EXPECT_EQ(request.tryAs<Int32>()->value, arrived++);
    static_cast<void>(server_->reply(std::move(request)));
  };
  for (int sent = 0; answered < kRequests;) {
    if (sent < kRequests && sent - answered < 100) {
      caller_->send(Int32Message({.value = sent++}));
    } else {
      EXPECT_EQ(next().tryAs<Int32>()->value, answered++);
    }
  }
}

TEST_F(RouterMessagesTest, OneRequestMayHaveManyRepliesOfAnyType) {
  const auto id = caller_->send(Int32Message({.value = 3}));
  auto request = nextRequest();
  auto array = server_->allocReplyMessage<Float64Array>(request, 3);
  auto later = server_->allocReplyMessage<OutOfBand>(request);
  later->value = 4;

  EXPECT_EQ(server_->reply(std::move(array)), ReplyResult::sent);
  EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  EXPECT_EQ(server_->reply(std::move(later)), ReplyResult::sent);

  const auto first = next();
  EXPECT_EQ(first.arrayLength(), 3u);
  EXPECT_TRUE(RelayClient::endsRequest(first));
  const auto second = next();
  EXPECT_EQ(second.tryAs<Int32>()->value, 3);
  EXPECT_FALSE(RelayClient::endsRequest(second));
  const auto third = next();
  EXPECT_EQ(third.tryAs<OutOfBand>()->value, 4);
  for (const auto* reply : {&first, &second, &third}) EXPECT_EQ(reply->route().requestId, id);
}

// A router sends the values one by one, while the server sends faster than the client takes them.
TEST_F(RouterMessagesTest, ManyValuesOfOneRequestArriveInOrder) {
  constexpr std::int32_t kValues = 2000;
  std::vector<std::int32_t> received;
  MessageClient client(*dispatcher_, [](const Message&) {});
  client.onValues<Int32>([&](std::span<const Int32> values, const Message& first) {
    EXPECT_EQ(first.getClientType(), 7);
    for (const auto& each : values) received.push_back(each.value);
  });
  client.bind("echo", RouterPair::kLocation);
  runUntil([&] { return client.isConnected(); });
  Int32Message message;
  message.setClientType(7);
  ASSERT_EQ(client.send(std::move(message)), SendResult::sent);
  const auto request = nextRequest();
  std::vector<Int32> values;
  for (std::int32_t i = 0; i < kValues; ++i) values.push_back({.value = i});

  std::span<const Int32> rest = values;
  runUntil([&] {
    const auto sent = server_->replyMany<Int32>(request, rest);
    EXPECT_TRUE(sent.result == ReplyResult::sent || sent.result == ReplyResult::queueFull);
    rest = rest.subspan(sent.count);
    return received.size() >= values.size();
  });

  ASSERT_EQ(received.size(), values.size());
  for (std::int32_t i = 0; i < kValues; ++i) EXPECT_EQ(received[static_cast<std::size_t>(i)], i);
}

// A subscription: after a request has ended, its client gets further messages between the replies
// to other requests.
TEST_F(RouterMessagesTest, AServerMaySendFurtherMessagesAfterItsReply) {
  caller_->send(Int32Message({.value = 1}));
  auto subscription = nextRequest();
  const auto kept = subscription.duplicate();
  EXPECT_EQ(server_->reply(std::move(subscription)), ReplyResult::sent);
  EXPECT_EQ(next().tryAs<Int32>()->value, 1);

  for (int i = 0; i < 500; ++i) {
    caller_->send(Int32Message({.value = 100 + i}));
    auto request = nextRequest();
    auto news = server_->allocReplyMessage<OutOfBand>(kept);
    news->value = i;
    EXPECT_EQ(server_->reply(std::move(news)), ReplyResult::sent);
    EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
    EXPECT_EQ(next().tryAs<OutOfBand>()->value, i);
    EXPECT_EQ(next().tryAs<Int32>()->value, 100 + i);
  }
}

TEST_F(RouterMessagesTest, AMessageLargerThanAllowedIsRefusedWhereItIsSent) {
  restartServer({.maxMessageBytes = 1000});

  EXPECT_EQ(caller_->client.send(array<Char8Array>(1000, [](auto) { return 'x'; })),
            SendResult::tooLarge);

  expectEcho(array<Char8Array>(1000 - sizeof(Char8Array), [](auto) { return 'x'; }));
}

}  // namespace
}  // namespace mpf::test
