// SPDX-License-Identifier: MIT
// Connections, replies, ownership.
#include <algorithm>
#include <cmath>
#include <thread>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

TEST_F(ClientTest, ConnectsWhicheverSideStartsFirst) {
  client_.bind("device[0]/a");
  EXPECT_EQ(client_.send(Int32Message()), SendResult::notConnected);
  EXPECT_THAT(client_.notConnectedBecause(), testing::HasSubstr("not running"));

  startServer();
  runUntil([&] { return client_.isConnected(); });

  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes));
  EXPECT_EQ(client_.notConnectedBecause(), "");
}

TEST_F(ClientTest, FindsARestartedServerByItself) {
  startServer();
  bind();

  server_.reset();
  runUntil([&] { return !client_.isConnected(); });
  startServer();
  runUntil([&] { return client_.isConnected(); });

  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo,
                                          ConnectStatus::connectYes));
}

TEST_F(ClientTest, RepliesHaveTheTimeStampOfTheServer) {
  startServer();
  auto request = heldRequest();
  EXPECT_EQ(request.getTimeStampNs(), 0);
  request.setTimeStampNs(0x0102'0304'0506'0708);
  auto further = server_->allocReplyMessage<Float64Array>(request, 1000);  // not in the ring
  further.setTimeStampNs(-1);

  ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  ASSERT_EQ(server_->reply(std::move(further)), ReplyResult::sent);

  EXPECT_EQ(next().getTimeStampNs(), 0x0102'0304'0506'0708);
  EXPECT_EQ(next().getTimeStampNs(), -1);
}

// A deadline is not a time stamp, though both are in the same place of a slot.
TEST_F(ClientTest, ARequestWithADeadlineHasNoTimeStamp) {
  startServer();
  Message request;
  server_->on<Int32>([&](Int32Message&& message) { request = std::move(message); });
  bind();
  ASSERT_EQ(client_.send(Int32Message(), Deadline::after(std::chrono::hours(1))), SendResult::sent);
  runUntil([&] { return static_cast<bool>(request); });

  EXPECT_EQ(request.getTimeStampNs(), 0);
  ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  EXPECT_EQ(next().getTimeStampNs(), 0);
}

TEST_F(ClientTest, AServerStampsItsRepliesIfItIsAskedTo) {
  startServer({.stampsReplies = true});
  auto request = heldRequest();
  auto stamped = request.duplicate();
  stamped.setTimeStampNs(5);
  const auto before = Clock::wallNs();

  ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  ASSERT_EQ(server_->reply(std::move(stamped)), ReplyResult::sent);

  const auto stamp = next().getTimeStampNs();
  EXPECT_GE(stamp, before);
  EXPECT_LE(stamp, Clock::wallNs());
  EXPECT_EQ(next().getTimeStampNs(), 5);
}

TEST_F(ClientTest, AConnectedClientHasThePidOfItsServer) {
  EXPECT_EQ(client_.serverPid(), 0);
  startServer();
  client_.bind("device[0]/a");
  runUntil([&] { return client_.isConnected(); });

  EXPECT_EQ(client_.serverPid(), ::getpid());

  server_.reset();
  runUntil([&] { return !client_.isConnected(); });
  EXPECT_EQ(client_.serverPid(), 0);
}

// The process of the server does not exit, and the server could not close a link.
TEST_F(ClientTest, AClientNoticesThatItsServerEndedBeforeItAcceptedTheClient) {
  startServer();
  serverRuns_ = false;
  client_.bind("device[0]/a");
  runUntil([&] { return client_.notConnectedBecause().find("not accepted") != std::string::npos; });

  server_.reset();
  runUntil([&] { return client_.notConnectedBecause().find("not running") != std::string::npos; });
  serverRuns_ = true;
  startServer();
  runUntil([&] { return client_.isConnected(); });

  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes));
}

// One hint announces any number of messages and the end after them.
TEST_F(ClientTest, AServerNoticesAClientThatDisconnectsRightAfterItsRequests) {
  constexpr int kMost = 40;
  int disconnected = 0;
  startServer().onClient(
      [&](std::uint64_t, bool isConnected) { disconnected += isConnected ? 0 : 1; });
  for (int requests = 1; requests <= kMost; ++requests) {
    MessageClient leaving(dispatcher_, [](const Message&) {});
    leaving.bind("device[0]/a");
    runUntil([&] { return leaving.isConnected(); });
    for (int i = 0; i < requests; ++i) static_cast<void>(leaving.send(Int32Message()));
    // The destructor disconnects the client.
  }
  runUntil([&] { return disconnected == kMost; });
}

TEST_F(ClientTest, AClientNoticesAServerThatEndsRightAfterItsReplies) {
  constexpr int kMost = 40;
  serverRuns_ = false;
  for (std::size_t replies = 1; replies <= kMost; ++replies) {
    auto& server = startServer();
    if (replies == 1) client_.bind("device[0]/a");
    Message request;
    while (!client_.isConnected() || client_.send(Int32Message()) != SendResult::sent) {
      EXPECT_FALSE(server.receive());
      dispatcher_.runOnce(Deadline::after(100us));
    }
    while (!request) request = server.receive();
    for (std::size_t extra = 1; extra < replies; ++extra)
      static_cast<void>(server.reply(request.duplicate()));
    static_cast<void>(server.reply(std::move(request)));

    server_.reset();

    runUntil([&] { return news_.back() == ConnectStatus::connectNo; });
    EXPECT_EQ(std::exchange(messages_, {}).size(), replies);
  }
}

TEST_F(ClientTest, EchoesEveryScalarTypeWithItsMarks) {
  auto& server = startServer();
  server.on<Int32>([](Int32&) {});
  server.on<Float64>([](Float64&) {});
  server.on<SerialConfig>([](SerialConfig&) {});
  server.on<OutOfBand>([](OutOfBand&) {});
  bind();

  Int32Message sent(
      {.timeout = 1, .cmd = 2, .status = 3, .address = 4, .extra = 5, .value = INT32_MIN});
  sent.setClientType(-7);
  sent.setClientExtra(77);
  ASSERT_EQ(client_.send(std::move(sent)), SendResult::sent);
  EXPECT_FALSE(sent);
  ASSERT_EQ(client_.send(Float64Message({.value = std::nan("")})), SendResult::sent);
  ASSERT_EQ(client_.send(SerialConfigMessage({.baud = 9600, .parity = 'E'})), SendResult::sent);
  ASSERT_EQ(client_.send(OutOfBandMessage({.value = 9})), SendResult::sent);

  auto echoed = next();
  ASSERT_NE(echoed.tryAs<Int32>(), nullptr);
  EXPECT_EQ(echoed.tryAs<Int32>()->value, INT32_MIN);
  EXPECT_EQ(echoed.tryAs<Int32>()->extra, 5);
  EXPECT_EQ(echoed.getClientType(), -7);
  EXPECT_EQ(echoed.getClientExtra(), 77);
  EXPECT_TRUE(std::isnan(next().tryAs<Float64>()->value));
  EXPECT_EQ(next().tryAs<SerialConfig>()->parity, 'E');
  EXPECT_EQ(next().tryAs<OutOfBand>()->value, 9);
}

class ArraySizes : public ClientTest, public testing::WithParamInterface<std::size_t> {};

TEST_P(ArraySizes, ArriveAndReturnUnchanged) {
  auto& server = startServer();
  server.on<Float64Array>([](Float64ArrayMessage&) {});
  server.on<Int32Array>([&](Int32ArrayMessage&& request) {
    auto reply = server.allocReplyMessage<Int32Array>(request, request.getLength());
    std::copy(request.value().begin(), request.value().end(), reply.value().begin());
    EXPECT_EQ(server.reply(std::move(reply)), ReplyResult::sent);
  });
  bind();
  const auto length = GetParam();
  auto numbers = client_.alloc<Int32Array>(length);
  for (std::size_t i = 0; i < length; ++i) numbers.value()[i] = static_cast<std::int32_t>(i * 3);

  ASSERT_EQ(client_.send(std::move(numbers)), SendResult::sent);

  auto reply = Int32ArrayMessage::tryFrom(next());
  ASSERT_TRUE(reply);
  ASSERT_EQ(reply->getLength(), length);
  for (std::size_t i = 0; i < length; i += 1 + length / 100)
    ASSERT_EQ(reply->value()[i], static_cast<std::int32_t>(i * 3));
}
INSTANTIATE_TEST_SUITE_P(InLineInChunksAndLarge, ArraySizes,
                         testing::Values(0, 1, 2, 3, 30, 42, 43, 1000, 100'000,
                                         (64u << 20) / 4 - 6));

TEST_F(ClientTest, ARequestReturnsInTheMemoryThatItWasBuiltIn) {
  auto& server = startServer();
  server.on<Char8Array>([](Char8Array& request) { request.status = 1; });
  bind();
  auto text = client_.alloc<Char8Array>(5000);
  const auto* built = text.value().data();

  ASSERT_EQ(client_.send(std::move(text)), SendResult::sent);

  auto reply = Char8ArrayMessage::tryFrom(next());
  EXPECT_EQ(reply->value().data(), built);
  EXPECT_EQ((*reply)->status, 1);
}

TEST_F(ClientTest, MemoryOfLargeMessagesIsReused) {
  auto& server = startServer({.maxPoolBytes = 4 << 20});
  server.on<Float64Array>([&](Float64ArrayMessage&& request) {
    EXPECT_EQ(server.reply(server.allocReplyMessage<Float64Array>(request, 20'000)),
              ReplyResult::sent);
  });
  bind();

  for (int i = 0; i < 500; ++i) {
    ASSERT_EQ(client_.send(client_.alloc<Float64Array>(20'000)), SendResult::sent);
    EXPECT_NE(next().tryAs<Float64Array>(), nullptr);
  }
}

TEST_F(ClientTest, AStoredRequestGetsManyRepliesLater) {
  auto& server = startServer();
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  bind();
  ASSERT_EQ(client_.send(Int32Message({.cmd = 3})), SendResult::sent);
  runUntil([&] { return static_cast<bool>(held); });

  std::thread other([&] {
    for (int i = 0; i < 10; ++i) {
      auto change = server.allocReplyMessage<Int32>(held);
      change->value = i;
      EXPECT_EQ(server.reply(std::move(change)), ReplyResult::sent);
    }
  });
  other.join();

  for (int i = 0; i < 10; ++i) EXPECT_EQ(next().tryAs<Int32>()->value, i);
  held = Message();
  ASSERT_EQ(client_.send(Int32Message({.value = 99})), SendResult::sent);
  runUntil([&] { return static_cast<bool>(held); });
  EXPECT_EQ(server.reply(std::move(held)), ReplyResult::sent);
  const auto last = next();
  ASSERT_NE(last.tryAs<Int32>(), nullptr) << "a request with a reply has no fate";
  EXPECT_EQ(last.tryAs<Int32>()->value, 99);
}

TEST_F(ClientTest, FurtherRepliesAreRefusedWhileTheClientDoesNotReceiveThem) {
  auto& server = startServer({.queueSize = 8});
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  bind();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  runUntil([&] { return static_cast<bool>(held); });

  int sent = 0;
  while (server.reply(server.allocReplyMessage<Int32>(held)) == ReplyResult::sent) ++sent;

  EXPECT_GE(sent, 16);
  for (int i = 0; i < sent; ++i) EXPECT_NE(next().tryAs<Int32>(), nullptr);
  EXPECT_EQ(server.reply(server.allocReplyMessage<Int32>(held)), ReplyResult::sent);
  EXPECT_NE(next().tryAs<Int32>(), nullptr);
}
TEST_F(ClientTest, AServerIdentifiesTheClientOfARequestWhileItIsConnected) {
  std::vector<Message> requests;
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) { requests.push_back(std::move(request)); });
  bind();
  auto other = std::make_unique<MessageClient>(dispatcher_, [](const Message&) {});
  other->bind("device[0]/a");
  runUntil([&] { return other->isConnected(); });
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  runUntil([&] { return requests.size() == 2; });
  ASSERT_EQ(other->send(Int32Message()), SendResult::sent);
  runUntil([&] { return requests.size() == 3; });
  EXPECT_EQ(server.clientOf(requests[0]), server.clientOf(requests[1]));
  EXPECT_NE(server.clientOf(requests[0]), server.clientOf(requests[2]));
  EXPECT_NE(server.clientOf(requests[2]), 0U);

  other.reset();
  runUntil([&] { return server.clientOf(requests[2]) == 0; });

  EXPECT_NE(server.clientOf(requests[0]), 0U);
  serverRuns_ = false;
  requests.clear();
  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_EQ(fateOf(next()), Fate::refused);
}

TEST_F(ClientTest, HandlesOutliveClientServerAndLink) {
  Message reply;
  {
    auto& server = startServer();
    server.on<Float64Array>([](Float64ArrayMessage&) {});
    bind();
    auto request = client_.alloc<Float64Array>(5000);
    request.value()[4999] = 0.5;
    ASSERT_EQ(client_.send(std::move(request)), SendResult::sent);
    reply = next();
    server_.reset();
    runUntil([&] { return !client_.isConnected(); });
  }

  EXPECT_EQ(reply.valueAs<Float64Array>()[4999], 0.5);
}

TEST_F(ClientTest, ANameIsServedOnceAtALocation) {
  startServer();

  EXPECT_THROW(MessageServer(backplane_, "device[0]/a"), NameInUse);
  MessageServer elsewhere(backplane_, "device[0]/a", {.location = 7});
  EXPECT_EQ(elsewhere.location(), 7);
}

// When a server appears, each step connects some of its clients, so that other work of the
// dispatcher is not delayed.
TEST_F(ClientTest, ManyClientsConnectInSteps) {
  constexpr int kCrowd = 100;
  std::vector<std::unique_ptr<MessageClient>> crowd;
  for (int i = 0; i < kCrowd; ++i) {
    crowd.push_back(std::make_unique<MessageClient>(dispatcher_, [](const Message&) {}));
    crowd.back()->bind("device[0]/a");
  }
  startServer();

  while (countNames(backplane_, NameKind::link) == 0) dispatcher_.runOnce(Deadline::after(100us));

  EXPECT_LT(countNames(backplane_, NameKind::link), kCrowd);
  runUntil([&] {
    return std::ranges::all_of(crowd, [](const auto& client) { return client->isConnected(); });
  });
}

}  // namespace
}  // namespace mpf::test
