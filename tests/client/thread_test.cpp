// SPDX-License-Identifier: MIT
// Any thread may bind, send, cancel and wait, whichever kind of dispatcher the client has;
// callbacks run on the thread that runs the dispatcher, and each request that was accepted has one
// reply or fate.
#include <thread>

#include <array>
#include <atomic>
#include <semaphore>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/client/client_fixture.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

constexpr int kSenders = 3;
constexpr int kEach = kIsSanitized ? 2'000 : 20'000;  // requests of a sender

enum class Kind { ownThread, run, runOnce, runPending };

std::string nameOfKind(const testing::TestParamInfo<Kind>& info) {
  constexpr std::array kNames{"SharedDispatcher", "Run", "RunOnce", "RunPending"};
  return kNames.at(static_cast<std::size_t>(info.param));
}

// A server, a dispatcher that a thread runs, and one client of both.
class ThreadTest : public testing::TestWithParam<Kind> {
 protected:
  ThreadTest() {
    server_.on<Int32>([](Int32&) {});
    serving_ = std::thread([this] { server_.run(); });
    if (GetParam() != Kind::ownThread) {
      dispatcher_.emplace(backplane_);
      running_ = std::thread([this] { runDispatcher(); });
    }
    // A thread that waits for a connection may run the dispatcher before another thread has run it.
    auto first = makeClient([](const Message&) {});
    first->bind("echo");
    while (!first->isConnected()) std::this_thread::yield();
  }
  ~ThreadTest() override {
    stop_ = true;
    if (dispatcher_) dispatcher_->interrupt();
    if (running_.joinable()) running_.join();
    server_.interrupt();
    serving_.join();
  }
  [[nodiscard]] std::unique_ptr<MessageClient> makeClient(MessageClient::Callback callback) {
    if (dispatcher_) return std::make_unique<MessageClient>(*dispatcher_, std::move(callback));
    return std::make_unique<MessageClient>(backplane_, std::move(callback));
  }
  void runDispatcher() {
    while (!stop_) {
      if (GetParam() == Kind::run) {
        dispatcher_->run();
      } else if (GetParam() == Kind::runOnce) {
        dispatcher_->runOnce(Deadline::after(100us));
      } else {
        dispatcher_->runPending();
      }
    }
  }

  Watchdog watchdog_{"client threads"};
  TestBackplane backplane_;
  MessageServer server_{backplane_, "echo", {.queueSize = 1000}};
  std::optional<Dispatcher> dispatcher_;
  std::atomic<bool> stop_{false};
  std::thread serving_;
  std::thread running_;
};

// What a client's callback has seen. Written without a lock: ThreadSanitizer finds a second thread.
struct Seen {
  std::vector<std::uint8_t> ends = std::vector<std::uint8_t>(std::size_t{kSenders} * kEach);
  std::thread::id thread;
  bool isOneThread = true;
  std::atomic<int> ended{0};

  void take(const Message& message) {
    const auto caller = std::this_thread::get_id();
    isOneThread = isOneThread && (thread == std::thread::id() || thread == caller);
    thread = caller;
    if (!RelayClient::endsRequest(message)) return;
    ++ends[static_cast<std::size_t>(message.getClientExtra())];
    ended.fetch_add(1);
  }
};

void sendAndCancel(MessageClient& client, int sender) {
  for (int i = 0; i < kEach;) {
    Int32Message request;
    request.setClientExtra(sender * kEach + i);
    std::uint32_t id = 0;
    if (client.send(std::move(request), Deadline::never(), &id) != SendResult::sent) {
      std::this_thread::yield();
      continue;
    }
    client.cancel(id);
    ++i;
  }
}

TEST_P(ThreadTest, EachRequestHasOneEndWhileManyThreadsCancel) {
  Seen seen;
  auto client = makeClient([&](const Message& message) { seen.take(message); });
  client->bind("echo");
  ASSERT_TRUE(client->connectWait(60s));
  std::vector<std::thread> threads;
  for (int sender = 0; sender < kSenders; ++sender) {
    threads.emplace_back([&, sender] { sendAndCancel(*client, sender); });
  }
  for (auto& thread : threads) thread.join();
  while (seen.ended != kSenders * kEach) std::this_thread::yield();
  // Nothing follows the last one: the client ends on the dispatcher's thread, or without it.
  client.reset();

  EXPECT_THAT(seen.ends, testing::Each(1));
  EXPECT_TRUE(seen.isOneThread);
  if (dispatcher_) {
    EXPECT_EQ(seen.thread, running_.get_id());
  }
}

// Several threads create and destroy clients while others send.
TEST_P(ThreadTest, ManyThreadsBindWaitAndDestroyTheirClients) {
  constexpr int kRounds = kIsSanitized ? 20 : 100;
  std::vector<std::thread> threads;
  std::atomic<int> connected{0};
  std::atomic<bool> isOneThread{true};
  for (int thread = 0; thread < kSenders; ++thread) {
    threads.emplace_back([&] {
      for (int round = 0; round < kRounds; ++round) {
        Seen seen;
        auto client = makeClient([&](const Message& message) { seen.take(message); });
        client->bind("echo");
        connected += client->connectWait(60s) ? 1 : 0;
        std::uint32_t id = 0;
        Int32Message request;
        if (client->send(std::move(request), Deadline::never(), &id) == SendResult::sent)
          client->cancel(id);
        client.reset();
        isOneThread = isOneThread && seen.isOneThread;
        isOneThread = isOneThread && seen.thread != std::this_thread::get_id();
      }
    });
  }
  for (auto& thread : threads) thread.join();

  EXPECT_EQ(connected, kSenders * kRounds);
  EXPECT_TRUE(isOneThread);
}

INSTANTIATE_TEST_SUITE_P(OfEachKind, ThreadTest,
                         testing::Values(Kind::ownThread, Kind::run, Kind::runOnce,
                                         Kind::runPending),
                         nameOfKind);

// The callback belongs to the thread that runs the dispatcher, which here does so later.
TEST_F(ClientTest, CancelLeavesTheFateToTheThreadThatRunsTheDispatcher) {
  startServer();
  const auto held = heldRequest();
  std::uint32_t id = 0;
  ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &id), SendResult::sent);

  std::thread([&] { client_.cancel(id); }).join();

  EXPECT_THAT(messages_, testing::IsEmpty());
  const auto end = next();
  EXPECT_EQ(fateOf(end), Fate::cancelled);
  EXPECT_EQ(end.tryAs<RequestFate>()->requestId, id);
  client_.cancel(held.route().requestId);
  EXPECT_THAT(messages_, testing::IsEmpty());
  EXPECT_EQ(fateOf(next()), Fate::cancelled);
}

// In a callback, the calling thread itself delivers the fate.
TEST_F(ClientTest, CancelInACallbackEndsTheRequestImmediately) {
  startServer().on<Int32>([](Int32&) {});
  std::vector<Message> held;
  server_->on<Float64>([&](Float64Message&& request) { held.push_back(std::move(request)); });
  std::uint32_t id = 0;
  std::vector<std::optional<Fate>> fates;
  MessageClient client(dispatcher_, [&](const Message& message) {
    if (message.tryAs<Int32>() != nullptr) {
      client.cancel(id);
      EXPECT_THAT(fates, testing::ElementsAre(Fate::cancelled));
    } else if (message.tryAs<RequestFate>() != nullptr) {
      fates.push_back(fateOf(message));
    }
  });
  client.bind("device[0]/a");
  runUntil([&] { return client.isConnected(); });
  ASSERT_EQ(client.send(Float64Message(), Deadline::never(), &id), SendResult::sent);
  runUntil([&] { return !held.empty(); });
  ASSERT_EQ(client.send(Int32Message()), SendResult::sent);

  runUntil([&] { return !fates.empty(); });
}

// A late cancel() finds no other request with that number on the next connection.
TEST_F(ClientTest, RequestIdsAreNotReusedOnTheNextConnection) {
  startServer().on<Int32>([](Int32&) {});
  bind();
  std::uint32_t first = 0;
  ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &first), SendResult::sent);
  static_cast<void>(next());
  server_.reset();
  runUntil([&] { return !client_.isConnected(); });
  startServer().on<Int32>([](Int32&) {});
  runUntil([&] { return client_.isConnected(); });

  std::uint32_t second = 0;
  ASSERT_EQ(client_.send(Int32Message(), Deadline::never(), &second), SendResult::sent);

  EXPECT_NE(second, first);
  static_cast<void>(next());
}

// connectWait() runs the dispatcher only until another thread calls run().
TEST_F(ClientTest, AWaitingThreadYieldsToTheThreadThatRunsTheDispatcher) {
  auto& server = startServer();
  std::thread serving([&] { server.run(); });
  std::binary_semaphore waiterRuns(0);
  MessageClient present(dispatcher_, [&](const Message&) { waiterRuns.release(); });
  present.bind("device[0]/a");
  std::atomic<bool> done{false};
  std::thread::id thread;
  MessageClient absent(dispatcher_, [&](const Message&) { thread = std::this_thread::get_id(); });
  absent.bind("later");
  bool isConnected = false;
  std::thread waiting([&] {
    isConnected = absent.connectWait(100s);
    done = true;
  });
  waiterRuns.acquire();

  dispatcher_.runOnce(Deadline::after(1ms));
  MessageServer later(backplane_, "later");
  while (!done) {
    later.handleOne();
    dispatcher_.runOnce(Deadline::after(100us));
  }
  waiting.join();

  EXPECT_TRUE(isConnected);
  EXPECT_EQ(thread, std::this_thread::get_id());
  server.interrupt();
  serving.join();
}

// Its last runner has ended: connectWait() runs the dispatcher as if no thread had run it before.
TEST_F(ClientTest, AWaitingThreadRunsADispatcherWhoseThreadHasEnded) {
  auto& server = startServer();
  std::thread serving([&] { server.run(); });
  std::thread([&] { dispatcher_.runOnce(Deadline::after(1ms)); }).join();
  client_.bind("device[0]/a");

  EXPECT_TRUE(client_.connectWait(100s));

  server.interrupt();
  serving.join();
}

// The second thread probably gets the stack and the thread-local memory of the first one, which has
// ended.
TEST_F(ClientTest, AWaitingThreadDoesNotRunADispatcherWhoseSecondThreadIsAlive) {
  auto& server = startServer();
  std::thread serving([&] { server.run(); });
  std::thread([&] { dispatcher_.runOnce(Deadline::after(1ms)); }).join();
  std::binary_semaphore hasRun(0);
  std::binary_semaphore mayEnd(0);
  std::thread second([&] {
    dispatcher_.runOnce(Deadline::after(1ms));
    hasRun.release();
    mayEnd.acquire();
  });
  hasRun.acquire();
  client_.bind("device[0]/a");

  EXPECT_FALSE(client_.connectWait(20ms));

  mayEnd.release();
  second.join();
  EXPECT_TRUE(client_.connectWait(100s));
  server.interrupt();
  serving.join();
}

TEST_F(ClientTest, ASecondThreadThatRunsTheDispatcherGetsAnError) {
  startServer();
  std::binary_semaphore isInside(0);
  std::binary_semaphore mayLeave(0);
  MessageClient client(dispatcher_, [&](const Message&) {
    isInside.release();
    mayLeave.acquire();
  });
  client.bind("device[0]/a");
  while (server_->handleOne()) {
  }
  std::thread running([&] { dispatcher_.runOnce(); });
  isInside.acquire();

  EXPECT_THROW(dispatcher_.runOnce(), std::logic_error);
  EXPECT_THROW(dispatcher_.runPending(), std::logic_error);
  EXPECT_FALSE(client_.connectWait(1ms));
  client_.bind("another");

  mayLeave.release();
  running.join();
  dispatcher_.runOnce(Deadline::atNs(0));
}

TEST_F(ClientTest, OtherThreadsCannotRunASharedDispatcher) {
  const auto shared = Dispatcher::shared(backplane_);
  MessageClient client(backplane_, [](const Message&) {});
  client.bind("absent");

  EXPECT_THROW(shared->runOnce(Deadline::atNs(0)), std::logic_error);
}

// interrupt() is for the thread that runs the dispatcher, not for one that waits for a connection.
TEST_F(ClientTest, AWaitForAConnectionLeavesAnInterruptToTheNextRun) {
  client_.bind("absent");
  dispatcher_.interrupt();

  EXPECT_FALSE(client_.connectWait(1ms));

  dispatcher_.run();
}

}  // namespace
}  // namespace mpf::test
