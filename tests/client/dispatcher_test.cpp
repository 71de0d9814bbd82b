// SPDX-License-Identifier: MIT
// Event loops, interrupts, threads, clients that are destroyed in callbacks.
#include <poll.h>

#include <atomic>
#include <thread>
#include <vector>

#include "tests/client/client_fixture.h"
#include "tests/support/test_backplane.h"

namespace mpf::test {
namespace {

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

// The thread of the event loop waits, also after another thread has run the dispatcher.
TEST_F(ClientTest, AThreadOfAnEventLoopIsWokenForAnEarlierDeadline) {
  auto& server = startServer();
  bind();
  runUntil([&] { return dispatcher_.nextDeadline().isNever(); });
  pollfd descriptor{dispatcher_.descriptor(), POLLIN, 0};
  std::thread([&] {
    while (!dispatcher_.runPending()) {
    }
  }).join();
  ASSERT_EQ(::poll(&descriptor, 1, 0), 0);

  ASSERT_EQ(client_.send(Int32Message(), Deadline::after(1ms)), SendResult::sent);

  EXPECT_EQ(::poll(&descriptor, 1, 0), 1);
  while (server.receive()) {
  }
}

TEST_F(ClientTest, AClientMayBeDestroyedInItsOwnCallback) {
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

// A loop that always has another message notices interrupt().
TEST_F(ClientTest, AnInterruptEndsAServerThatIsNeverIdle) {
  auto& server = startServer();
  int handled = 0;
  server.on<Int32>([&](Int32&) {
    if (++handled == 10) server.interrupt();
    if (handled == 1000) return;  // the interrupt was not noticed
    while (dispatcher_.runOnce(Deadline::atNs(0))) {
    }
    ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);

  server.run();

  EXPECT_EQ(handled, 10);
  messages_.clear();
}

TEST_F(ClientTest, AnInterruptEndsADispatcherThatIsNeverIdle) {
  auto& server = startServer();
  server.on<Int32>([](Int32&) {});
  int replies = 0;
  MessageClient busy(dispatcher_, [&](const Message& message) {
    if (message.getType() != MessageType::int32) return;
    if (++replies == 50) dispatcher_.interrupt();
    if (replies == 1000) return dispatcher_.interrupt();  // the interrupt was not noticed
    ASSERT_EQ(busy.send(Int32Message()), SendResult::sent);
    while (server.handleOne()) {
    }
  });
  busy.bind("device[0]/a");
  runUntil([&] { return busy.isConnected(); });
  ASSERT_EQ(busy.send(Int32Message()), SendResult::sent);
  while (server.handleOne()) {
  }

  dispatcher_.run();

  EXPECT_LT(replies, 100);
}

TEST_F(ClientTest, ARequestExpiresWhileAnotherClientAlwaysHasMessages) {
  auto& server = startServer();
  server.on<Int32>([](Int32&) {});
  MessageServer silent(backplane_, "silent");
  std::optional<Fate> fate;
  MessageClient patient(dispatcher_, [&](const Message& message) { fate = fateOf(message); });
  MessageClient busy(dispatcher_, [&](const Message& message) {
    if (message.getType() != MessageType::int32) return;
    ASSERT_EQ(busy.send(Int32Message()), SendResult::sent);
    while (server.handleOne()) {
    }
  });
  patient.bind("silent");
  busy.bind("device[0]/a");
  runUntil([&] {
    silent.handleOne();
    return patient.isConnected() && busy.isConnected();
  });
  ASSERT_EQ(busy.send(Int32Message()), SendResult::sent);
  while (server.handleOne()) {
  }
  const auto deadline = Deadline::after(1ms);
  ASSERT_EQ(patient.send(Int32Message(), deadline), SendResult::sent);

  while (!deadline.hasPassed()) dispatcher_.runOnce();
  for (int runs = 0; runs < 100 && !fate; ++runs) dispatcher_.runOnce();

  EXPECT_EQ(fate, Fate::expired);
}

// Callbacks of one client never run at the same time, whichever threads send.
TEST(SharedDispatcher, RunsOneCallbackAtATimeForManyThreads) {
  const Watchdog watchdog("shared dispatcher");
  const TestBackplane backplane;
  MessageServer server(backplane, "echo", {.queueSize = 1000});
  server.on<Int32>([](Int32&) {});
  std::thread serving([&] { server.run(); });
  int replies = 0;  // unprotected: ThreadSanitizer reports concurrent access
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

// A server that always has work stops, and the requests that it has not received are not performed.
TEST_F(ClientTest, AnInterruptEndsTheServerBetweenTwoRequests) {
  int handled = 0;
  auto& server = startServer();
  server.on<Int32>([&](Int32&) {
    ++handled;
    server.interrupt();
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message({.value = 1})), SendResult::sent);
  ASSERT_EQ(client_.send(Int32Message({.value = 2})), SendResult::sent);

  server.run();

  EXPECT_EQ(handled, 1);
  server_.reset();
  EXPECT_EQ(next().tryAs<Int32>()->value, 1);
  EXPECT_EQ(fateOf(next()), Fate::neverTaken);
}

}  // namespace
}  // namespace mpf::test
