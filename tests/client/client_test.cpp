// SPDX-License-Identifier: MIT
// Clients and servers, each run by the test's own thread unless a test is about threads.
#include <poll.h>

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <thread>
#include <vector>

#include <mpf/client/sync_client.h>
#include <mpf/server/message_server.h>
#include <mpf/tests/support/watchdog.h>

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

// A server and a client that take turns in one thread.
class ClientTest : public testing::Test {
 protected:
  MessageServer& startServer(ServerOptions options = {}) {
    server_ = std::make_unique<MessageServer>(backplane_, "device[0]/a", options);
    return *server_;
  }
  void bind() {
    client_.bind("device[0]/a");
    if (server_) runUntil([&] { return client_.isConnected(); });
  }
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) {
      if (server_ && serverRuns_) server_->handleOne();
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  // The next message that is no ConnectMessage.
  Message next() {
    runUntil([&] { return !messages_.empty(); });
    auto message = std::move(messages_.front());
    messages_.erase(messages_.begin());
    return message;
  }
  void TearDown() override {
    EXPECT_THAT(messages_, testing::IsEmpty());
    server_.reset();
  }

  Watchdog watchdog_{"client test"};
  Backplane backplane_ = Backplane::isolated();
  std::unique_ptr<MessageServer> server_;
  bool serverRuns_ = true;
  std::vector<Message> messages_;
  std::vector<ConnectStatus> news_;
  Dispatcher dispatcher_{backplane_};
  MessageClient client_{dispatcher_, [this](Message message) {
                          if (const auto* connect = message.tryAs<Connect>()) {
                            news_.push_back(connect->status);
                          } else {
                            messages_.push_back(std::move(message));
                          }
                        }};
};

std::optional<Fate> fateOf(const Message& message) {
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr ? std::optional(fate->fate) : std::nullopt;
}

TEST_F(ClientTest, ConnectsWhicheverSideStartsFirst) {
  client_.bind("device[0]/a");
  EXPECT_EQ(client_.send(Int32Message()), SendResult::notConnected);
  EXPECT_THAT(client_.notConnectedBecause(), testing::HasSubstr("not there"));

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

  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo, ConnectStatus::connectYes));
}

TEST_F(ClientTest, EchoesEveryScalarTypeWithItsMarks) {
  auto& server = startServer();
  server.on<Int32>([](Int32&) {});
  server.on<Float64>([](Float64&) {});
  server.on<SerialConfig>([](SerialConfig&) {});
  server.on<OutOfBand>([](OutOfBand&) {});
  bind();

  Int32Message sent({.timeout = 1, .cmd = 2, .status = 3, .address = 4, .extra = 5, .value = INT32_MIN});
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

TEST_P(ArraySizes, ArriveAndComeBackWhole) {
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
  for (std::size_t i = 0; i < length; i += 1 + length / 100) ASSERT_EQ(reply->value()[i], static_cast<std::int32_t>(i * 3));
}
INSTANTIATE_TEST_SUITE_P(InLineInChunksAndLarge, ArraySizes, testing::Values(0, 1, 2, 3, 30, 42, 43, 1000, 100'000, (64u << 20) / 4 - 6));

TEST_F(ClientTest, ARequestComesBackInTheMemoryItWasBuiltIn) {
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

TEST_F(ClientTest, MemoryOfLargeMessagesIsUsedAgain) {
  auto& server = startServer({.maxPoolBytes = 4 << 20});
  server.on<Float64Array>([&](Float64ArrayMessage&& request) {
    EXPECT_EQ(server.reply(server.allocReplyMessage<Float64Array>(request, 20'000)), ReplyResult::sent);
  });
  bind();

  for (int i = 0; i < 500; ++i) {
    ASSERT_EQ(client_.send(client_.alloc<Float64Array>(20'000)), SendResult::sent);
    EXPECT_NE(next().tryAs<Float64Array>(), nullptr);
  }
}

TEST_F(ClientTest, AHeldRequestIsAnsweredManyTimesLater) {
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
  EXPECT_FALSE(dispatcher_.runOnce(Deadline::after(1ms))) << "an answered request has no fate";
}

TEST_F(ClientTest, StreamedRepliesAreRefusedWhileTheClientDoesNotTakeThem) {
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

TEST_F(ClientTest, AFullQueueRefusesAtOnceAndSaysSoOnce) {
  startServer({.queueSize = 5}).on<Int32>([](Int32&) {});
  bind();
  serverRuns_ = false;
  for (int i = 0; i < 5; ++i) ASSERT_EQ(client_.send(Int32Message({.value = i})), SendResult::sent);

  Int32Message sixth({.value = 6});
  EXPECT_EQ(client_.send(std::move(sixth)), SendResult::queueFull);
  EXPECT_EQ(sixth->value, 6) << "a message that was refused is still the caller's";
  EXPECT_EQ(client_.send(std::move(sixth)), SendResult::queueFull);

  runUntil([&] { return news_.size() == 2; });
  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectQueueFull));
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

TEST_F(ClientTest, ARequestThatIsNotTakenInTimeExpiresOnce) {
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
  EXPECT_NE(next().tryAs<Float64>(), nullptr) << "the server passed the expired one without a word";
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

TEST_F(ClientTest, AServerThatEndsGivesEachRequestItsFate) {
  auto& server = startServer();
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  bind();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  runUntil([&] { return static_cast<bool>(held); });
  serverRuns_ = false;
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);

  server_.reset();

  std::vector<std::optional<Fate>> fates{fateOf(next()), fateOf(next())};
  EXPECT_THAT(fates, testing::UnorderedElementsAre(Fate::outcomeUnknown, Fate::neverTaken));
  runUntil([&] { return !client_.isConnected() && news_.size() == 2; });
  held = Message();  // outlives its server
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

TEST_F(ClientTest, ADescriptorWakesAnEventLoop) {
  auto& server = startServer();
  server.on<Int32>([](Int32&) {});
  bind();
  pollfd serverFd{server.descriptor(), POLLIN, 0};
  pollfd clientFd{dispatcher_.descriptor(), POLLIN, 0};
  while (server.handleOne()) {
  }
  dispatcher_.runPending();

  ASSERT_EQ(client_.send(Int32Message({.value = 4})), SendResult::sent);
  ASSERT_EQ(::poll(&serverFd, 1, -1), 1);
  while (server.handleOne()) {
  }
  ASSERT_EQ(::poll(&clientFd, 1, -1), 1);
  dispatcher_.runPending();

  ASSERT_EQ(messages_.size(), 1u);
  EXPECT_EQ(messages_[0].tryAs<Int32>()->value, 4);
  messages_.clear();
}

TEST_F(ClientTest, AClientMayEndInItsOwnCallback) {
  startServer().on<Int32>([](Int32&) {});
  std::unique_ptr<MessageClient> brief;
  brief = std::make_unique<MessageClient>(dispatcher_, [&](const Message& message) {
    if (message.getType() == MessageType::int32) brief.reset();
  });
  brief->bind("device[0]/a");
  runUntil([&] { return brief->isConnected(); });
  ASSERT_EQ(brief->send(Int32Message()), SendResult::sent);

  runUntil([&] { return !brief; });
}

// Callbacks of one client never run at the same time, whoever sends.
TEST(SharedDispatcher, RunsOneCallbackAtATimeForManyThreads) {
  const Watchdog watchdog("shared dispatcher");
  const auto backplane = Backplane::isolated();
  MessageServer server(backplane, "echo", {.queueSize = 1000});
  server.on<Int32>([](Int32&) {});
  std::thread serving([&] { server.run(); });
  int replies = 0;  // unprotected: ThreadSanitizer looks on
  std::atomic<int> done{0};
  constexpr int kThreads = 4;
  constexpr int kEach = 500;
  {
    MessageClient client(backplane, [&](const Message& message) {
      if (message.getType() != MessageType::int32) return;
      if (++replies == kThreads * kEach) done.store(1);
    });
    client.bind("echo");
    ASSERT_TRUE(client.connectWait(60s));
    std::vector<std::thread> senders;
    for (int thread = 0; thread < kThreads; ++thread) {
      senders.emplace_back([&] {
        for (int i = 0; i < kEach; ++i) {
          Int32Message message;
          while (client.send(std::move(message)) != SendResult::sent) std::this_thread::yield();
        }
      });
    }
    for (auto& sender : senders) sender.join();
    while (done.load() == 0) std::this_thread::yield();
  }
  server.interrupt();
  serving.join();
  EXPECT_EQ(replies, kThreads * kEach);
}

TEST(SyncClientTest, SaysWhyThereIsNoAnswer) {
  const Watchdog watchdog("sync client");
  const auto backplane = Backplane::isolated();
  SyncClient client(backplane, "echo");
  auto none = client.call(Int32Message(), 1ms);
  EXPECT_EQ(none.refusal(), SendResult::notConnected);

  MessageServer server(backplane, "echo");
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  std::thread serving([&] { server.run(); });
  ASSERT_TRUE(client.connectWait(60s));
  auto unknown = client.call(Int32Message(), 50ms);
  server.interrupt();
  serving.join();
  auto expired = client.call(Int32Message(), 5ms);

  EXPECT_EQ(unknown.fate(), Fate::outcomeUnknown);
  EXPECT_EQ(expired.fate(), Fate::expired);
  EXPECT_EQ(expired.why(), "no reply: expired");
}

}  // namespace
}  // namespace mpf::test
