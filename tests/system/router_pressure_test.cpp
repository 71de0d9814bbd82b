// SPDX-License-Identifier: MIT
// Slow and stopped clients and servers: each fills its own queue up to its limit, and delays no
// other process.
#include <sys/wait.h>

#include <ctime>

#include <mpf/sync_client.h>

#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

class RouterPressureTest : public RouterTest {
 protected:
  // Starts mpf-int32-server.
  Victim startServer(const std::string& name, const std::string& queueSize) const {
    return {MPF_TEST_INT32_SERVER,
            std::vector<std::string>{
                name, "--queue-size", queueSize, "--backplane", routers_.far().name(), "--location",
                std::to_string(RouterPair::kLocation), "--log-level", "warning"}};
  }
  // Starts both routers and the server, which receives a request (-1) of `slow`, a client with a
  // small window. The dispatcher `its` does not run after that. The local router gives up after
  // `patience` when a server has ended and `slow` does not receive its last replies.
  Message subscribe(Dispatcher& its, Caller& slow, const std::string& patience = "60s") {
    routers_.startFar();
    routers_.startNear({"--window-size", "64KiB", "--dead-time", patience});
    openServer();
    while (!slow.isConnected()) {
      runServer();
      its.runOnce(Deadline::after(200us));
    }
    slow.send(Int32Message({.value = -1}));
    return nextRequest();
  }
  void expectAnswers(const std::string& server, int count) const {
    SyncClient client(routers_.near(), server, RouterPair::kLocation);
    for (int i = 0; i < count; ++i) {
      auto answer = client.call(Int32Message({.value = i}), 100s);
      ASSERT_TRUE(answer) << answer.why();
      EXPECT_EQ(answer.message().tryAs<Int32>()->value, i);
    }
  }
};

TEST_F(RouterPressureTest, AStoppedServerFillsItsOwnQueueAndDelaysNoOther) {
  constexpr int kQueueSize = 20;
  routers_.start();
  const auto other = startServer("other", "100");
  auto stopped = startServer("stopped", std::to_string(kQueueSize));
  Caller caller(*dispatcher_, "stopped");
  runUntil([&] { return caller.isConnected(); });
  expectAnswers("stopped", 1);
  expectAnswers("other", 1);
  stopped.stop();

  for (int value = 0; value < kQueueSize; ++value) caller.send(Int32Message({.value = value}));
  waitUntilTaken("stopped", kQueueSize + 1);
  for (int refused = 0; refused < 100; ++refused) {
    caller.send(Int32Message({.value = -1}));
    runUntil([&] { return !caller.messages.empty(); });
    EXPECT_EQ(fateOf(caller.take()), Fate::refused);
  }
  runUntil([&] { return caller.news.size() == 2; });
  EXPECT_THAT(caller.news,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectQueueFull));
  expectAnswers("other", 100);

  stopped.signal(SIGCONT);
  for (int value = 0; value < kQueueSize; ++value) {
    runUntil([&] { return !caller.messages.empty(); });
    EXPECT_EQ(caller.take().tryAs<Int32>()->value, value);
  }
}

// The server is notified that the client does not receive its replies, other clients get theirs,
// and when the client continues, it gets everything that was sent.
TEST_F(RouterPressureTest, AClientThatDoesNotReceiveItsRepliesDelaysNoOther) {
  Dispatcher idle(routers_.near());
  Caller slow(idle, "echo");
  const auto subscription = subscribe(idle, slow);
  caller_.emplace(*dispatcher_);
  runUntil([&] { return caller_->isConnected(); });

  EXPECT_EQ(server_->reply(subscription.duplicate()), ReplyResult::sent);
  int sent = 0;
  for (int refused = 0; refused < 50;) {
    auto news = server_->allocReplyMessage<OutOfBand>(subscription);
    news->value = sent;
    if (server_->reply(std::move(news)) == ReplyResult::sent) {
      ++sent;
    } else {
      ++refused;
      expectAnswer();
    }
  }
  EXPECT_GT(sent, 64 << 10 >> 7) << "the window was used";

  for (int expected = -1; expected < sent; ++expected) {
    while (slow.messages.empty()) idle.runOnce();
    const auto message = slow.take();
    ASSERT_EQ(message.getType(), expected < 0 ? MessageType::int32 : MessageType::outOfBand);
    EXPECT_EQ(expected < 0 ? message.tryAs<Int32>()->value : message.tryAs<OutOfBand>()->value,
              expected);
  }
}

TEST_F(RouterPressureTest, AFloodOfOneClientDoesNotStarveAnother) {
  startAll();
  ::setenv("MPF_LOCATION", std::to_string(RouterPair::kLocation).c_str(), 1);
  std::vector<Victim> floods;
  for (int i = 0; i < 2; ++i) floods.emplace_back("flood", routers_.near().name());
  int ofFloods = 0;
  serve_ = [&](Message&& request) {
    const auto* int32 = request.tryAs<Int32>();
    ofFloods += int32 == nullptr || int32->cmd == 0 ? 1 : 0;
    static_cast<void>(server_->reply(std::move(request)));
  };
  runUntil([&] { return ofFloods > 1000; });

  for (int i = 0; i < 100; ++i) {
    caller_->send(Int32Message({.cmd = 1, .value = i}));
    EXPECT_EQ(next().tryAs<Int32>()->value, i);
  }
}

// Clients are bound to more absent servers than a router handles in one turn of its loop.
TEST_F(RouterPressureTest, TheRouterSleepsWhileManyServersAreIdle) {
  constexpr int kServers = 300;
  std::vector<std::unique_ptr<Caller>> waiting;
  for (int i = 0; i < kServers; ++i)
    waiting.push_back(std::make_unique<Caller>(*dispatcher_, "nobody" + std::to_string(i)));
  startAll();
  expectAnswer();
  clockid_t clock{};
  ASSERT_EQ(::clock_getcpuclockid(routers_.nearRouter().pid(), &clock), 0);
  const auto used = [&] {
    timespec now{};
    ::clock_gettime(clock, &now);
    return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
  };

  for (auto before = used();; before = used()) {  // until the router sleeps most of the time
    runFor(200ms);
    if (used() - before < 20ms) break;
  }
}

// The requests to the first server fill the line as soon as it has room.
TEST_F(RouterPressureTest, AFloodOfOneServerDoesNotStarveAnother) {
  startAll({"--queue-size", "10"});
  const auto last = startServer("zebra", "100");
  ::setenv("MPF_LOCATION", std::to_string(RouterPair::kLocation).c_str(), 1);
  std::vector<Victim> floods;
  for (int i = 0; i < 2; ++i) floods.emplace_back("flood", routers_.near().name());
  Caller zebra(*dispatcher_, "zebra");
  runUntil([&] { return zebra.isConnected(); });

  for (int i = 0; i < 20; ++i) {
    zebra.send(Int32Message({.value = i}));
    runUntil([&] { return !zebra.messages.empty(); });
    EXPECT_EQ(zebra.take().tryAs<Int32>()->value, i);
  }
}

// A client on the other host is stopped and its window is full; it is still notified of the end.
TEST_F(RouterPressureTest, TheEndOfAServerReachesAllClientsAlthoughOneIsStopped) {
  Dispatcher idle(routers_.near());
  Caller slow(idle, "echo");
  auto subscription = subscribe(idle, slow, "3s");
  EXPECT_EQ(server_->reply(subscription.duplicate()), ReplyResult::sent);
  caller_.emplace(*dispatcher_);
  for (int refused = 0; refused < 50;) {
    if (server_->reply(server_->allocReplyMessage<OutOfBand>(subscription)) == ReplyResult::sent)
      continue;
    ++refused;
    expectAnswer();
  }

  subscription = {};
  server_.reset();
  waitForNews(ConnectStatus::connectNo);
  openServer();

  expectAnswer();
}

// The large messages have one megabyte and use the same line.
TEST_F(RouterPressureTest, LargeMessagesOfOneClientDoNotKeepSmallOnesWaiting) {
  constexpr std::size_t kElements = 1 << 17;
  startAll();
  Caller large(*dispatcher_, "echo");
  runUntil([&] { return large.isConnected(); });
  // After this reply the server has accepted the client, and no router holds messages for it.
  large.send(Int32Message());
  runUntil([&] { return !large.messages.empty(); });
  static_cast<void>(large.take());
  int larges = 0;
  const auto sendLarge = [&] {
    while (large.open.size() < 8) large.send(large.client.alloc<Float64Array>(kElements));
    for (auto message = large.take(); message; message = large.take()) {
      EXPECT_EQ(message.arrayLength(), kElements);
      ++larges;
    }
  };

  for (int i = 0; i < 20; ++i) {
    sendLarge();
    caller_->send(Int32Message({.value = i}));
    const auto before = larges;
    runUntil([&] {
      sendLarge();
      return !caller_->messages.empty();
    });
    EXPECT_EQ(caller_->take().tryAs<Int32>()->value, i);
    EXPECT_LE(larges - before, 32) << "those that were already on the line, in both directions";
  }
  runUntil([&] { return large.open.empty(); });
}

}  // namespace
}  // namespace mpf::test
