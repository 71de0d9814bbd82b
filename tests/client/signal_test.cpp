// SPDX-License-Identifier: MIT
// Signals that arrive in a wait neither end it early nor keep it from ending.
#include <signal.h>

#include <pthread.h>

#include <atomic>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "tests/support/test_backplane.h"
#include "tests/support/wait_modes.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

std::atomic<int> signalsHandled{0};
void handle(int) { signalsHandled.fetch_add(1, std::memory_order_relaxed); }

// A thread that receives SIGUSR1 continuously, with a handler that interrupts system calls.
class Bombarded {
 public:
  explicit Bombarded(std::function<void()> work)
      : thread_([this, work = std::move(work)] {
          work();
          done_.store(true);
        }) {}
  // Sends signals until that many have been handled.
  void bombard(int signals) {
    const int from = signalsHandled.load();
    while (!done_.load() && signalsHandled.load() - from < signals) sendOne();
  }
  // Sends signals until the work is done.
  void join() {
    while (!done_.load()) sendOne();
    thread_.join();
  }
  [[nodiscard]] bool isDone() const { return done_.load(); }

 private:
  void sendOne() {
    ::pthread_kill(thread_.native_handle(), SIGUSR1);
    std::this_thread::yield();
  }
  std::atomic<bool> done_{false};
  std::thread thread_;
};

constexpr int kSignals = 300;

class SignalTest : public testing::TestWithParam<WaitMode> {
 protected:
  void SetUp() override {
    struct sigaction action{};
    action.sa_handler = handle;  // no SA_RESTART: system calls return EINTR
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGUSR1, &action, &before_);
  }
  void TearDown() override { ::sigaction(SIGUSR1, &before_, nullptr); }
  MessageServer makeServer() const {
    return {backplane_, "device", {.location = 0, .waitMode = GetParam()}};
  }
  // Runs `server` on another thread, without signals.
  struct Running {
    explicit Running(MessageServer& itsServer) : server(itsServer), thread([&] { server.run(); }) {}
    ~Running() {
      server.interrupt();
      thread.join();
    }
    MessageServer& server;
    std::thread thread;
  };

  Watchdog watchdog_{"signal test"};
  TestBackplane backplane_;
  struct sigaction before_{};
};

TEST_P(SignalTest, AServerThatWaitsWithoutADeadlineGetsItsMessage) {
  auto server = makeServer();
  SyncClient client(backplane_, "device", 0);
  int ended = 0;
  int inVain = 0;
  Message got;
  Bombarded waiting([&] {
    while (!got) {
      if (!server.waitForMessage()) ++ended;
      got = server.receive();
      if (!got) ++inVain;
    }
  });
  ASSERT_TRUE(client.connectWait(60s));

  waiting.bombard(kSignals);
  EXPECT_FALSE(waiting.isDone());
  ASSERT_EQ(client.client().send(Int32Message({.value = 7})), SendResult::sent);
  waiting.join();

  EXPECT_EQ(ended, 0) << "a signal ended a wait without a deadline";
  EXPECT_LT(inVain, kSignals / 10) << "connecting clients may end a wait, signals must not";
  EXPECT_EQ(got.tryAs<Int32>()->value, 7);
}

TEST_P(SignalTest, AServersDeadlineHolds) {
  auto server = makeServer();
  const auto deadline = Deadline::after(100ms);
  std::int64_t endedNs = 0;
  bool result = true;

  Bombarded waiting([&] {
    result = server.waitForMessage(deadline);
    endedNs = Clock::nowNs();
  });
  waiting.join();

  EXPECT_FALSE(result);
  EXPECT_GE(endedNs, deadline.ns());
}

TEST_P(SignalTest, AnInterruptEndsAServersWait) {
  auto server = makeServer();
  bool result = true;
  Bombarded waiting([&] { result = server.waitForMessage(); });

  waiting.bombard(kSignals);
  EXPECT_FALSE(waiting.isDone());
  server.interrupt();
  waiting.join();

  EXPECT_FALSE(result);
}

TEST_P(SignalTest, AClientWaitsForItsServer) {
  Dispatcher dispatcher(backplane_, {GetParam(), {}});
  MessageClient client(dispatcher, [](const Message&) {});
  client.bind("device", 0);
  bool result = false;
  Bombarded waiting([&] { result = client.connectWait(60s); });

  waiting.bombard(kSignals);
  EXPECT_FALSE(waiting.isDone());
  auto server = makeServer();
  const Running running(server);
  waiting.join();

  EXPECT_TRUE(result);
}

TEST_P(SignalTest, AClientsTimeoutHolds) {
  Dispatcher dispatcher(backplane_, {GetParam(), {}});
  MessageClient client(dispatcher, [](const Message&) {});
  client.bind("device", 0);
  const auto deadline = Deadline::after(100ms);
  std::int64_t endedNs = 0;
  bool result = true;

  Bombarded waiting([&] {
    result = client.connectWait(100ms);
    endedNs = Clock::nowNs();
  });
  waiting.join();

  EXPECT_FALSE(result);
  EXPECT_GE(endedNs, deadline.ns());
}

TEST_P(SignalTest, ACallGetsItsReply) {
  auto server = makeServer();
  std::atomic<bool> hasRequest{false};
  Message held;
  server.on<Int32>([&](Int32Message&& request) {
    held = std::move(request);
    hasRequest.store(true);
  });
  const Running running(server);
  SyncClient client(backplane_, "device", 0, GetParam());
  std::optional<Answer> answer;
  Bombarded calling([&] { answer = client.call(Int32Message({.value = 5}), 60s); });

  while (!hasRequest.load()) calling.bombard(1);
  calling.bombard(kSignals);
  EXPECT_FALSE(calling.isDone());
  EXPECT_EQ(server.reply(std::move(held)), ReplyResult::sent);
  calling.join();

  ASSERT_TRUE(*answer) << answer->why();
  EXPECT_EQ(answer->message().tryAs<Int32>()->value, 5);
}

TEST_P(SignalTest, ACallWithoutReplyEndsAfterItsTimeout) {
  auto server = makeServer();
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  const Running running(server);
  SyncClient client(backplane_, "device", 0, GetParam());
  ASSERT_TRUE(client.connectWait(60s));
  std::int64_t deadlineNs = 0;
  std::int64_t endedNs = 0;
  std::optional<Answer> answer;

  Bombarded calling([&] {
    deadlineNs = Deadline::after(200ms).ns();
    answer = client.call(Int32Message(), 200ms);
    endedNs = Clock::nowNs();
  });
  calling.join();

  // expired: the server was slower
  EXPECT_THAT(answer->fate(), testing::AnyOf(Fate::outcomeUnknown, Fate::expired)) << answer->why();
  EXPECT_GE(endedNs, deadlineNs);
}

TEST_P(SignalTest, AReceiverGetsALaterReply) {
  auto server = makeServer();
  std::atomic<bool> hasRequest{false};
  Message held;
  server.on<Int32>([&](Int32Message&& request) {
    EXPECT_EQ(server.reply(server.allocReplyMessage<Int32>(request)), ReplyResult::sent);
    held = std::move(request);
    hasRequest.store(true);
  });
  const Running running(server);
  SyncClient client(backplane_, "device", 0, GetParam());
  ASSERT_TRUE(client.call(Int32Message(), 60s));
  while (!hasRequest.load()) std::this_thread::yield();
  Message got;
  Bombarded receiving([&] { got = client.receive(60s); });

  receiving.bombard(kSignals);
  EXPECT_FALSE(receiving.isDone());
  auto later = server.allocReplyMessage<Int32>(held);
  later->value = 9;
  EXPECT_EQ(server.reply(std::move(later)), ReplyResult::sent);
  receiving.join();

  ASSERT_NE(got.tryAs<Int32>(), nullptr);
  EXPECT_EQ(got.tryAs<Int32>()->value, 9);
}

TEST_P(SignalTest, AReceiversTimeoutHolds) {
  SyncClient client(backplane_, "device", 0, GetParam());
  const auto deadline = Deadline::after(100ms);
  std::int64_t endedNs = 0;
  Message got;

  Bombarded receiving([&] {
    got = client.receive(100ms);
    endedNs = Clock::nowNs();
  });
  receiving.join();

  EXPECT_FALSE(got);
  EXPECT_GE(endedNs, deadline.ns());
}

TEST_P(SignalTest, ADispatcherRunsUntilItIsInterrupted) {
  Dispatcher dispatcher(backplane_, {GetParam(), {}});
  Bombarded running([&] { dispatcher.run(); });

  running.bombard(kSignals);
  EXPECT_FALSE(running.isDone());
  dispatcher.interrupt();
  running.join();
}

TEST_P(SignalTest, ADispatchersDeadlineHolds) {
  Dispatcher dispatcher(backplane_, {GetParam(), {}});
  const auto deadline = Deadline::after(100ms);
  std::int64_t endedNs = 0;
  bool result = true;

  Bombarded running([&] {
    result = dispatcher.runOnce(deadline);
    endedNs = Clock::nowNs();
  });
  running.join();

  EXPECT_FALSE(result);
  EXPECT_GE(endedNs, deadline.ns());
}

INSTANTIATE_TEST_SUITE_P(InEachWaitMode, SignalTest, kWaitModes, nameOfWaitMode);

// The wait for the thread of a shared dispatcher uses a condition variable.
TEST(SharedDispatcherSignals, AClientWaitsForItsServerAndItsTimeoutHolds) {
  const Watchdog watchdog("signal test");
  struct sigaction action{};
  struct sigaction before{};
  action.sa_handler = handle;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(SIGUSR1, &action, &before);
  const TestBackplane backplane;
  MessageClient client(backplane, [](const Message&) {});
  client.bind("device", 0);
  const auto deadline = Deadline::after(100ms);
  std::int64_t endedNs = 0;
  bool early = true;
  bool late = false;

  Bombarded impatient([&] {
    early = client.connectWait(100ms);
    endedNs = Clock::nowNs();
  });
  impatient.join();
  Bombarded patient([&] { late = client.connectWait(60s); });
  patient.bombard(kSignals);
  EXPECT_FALSE(patient.isDone());
  MessageServer server(backplane, "device", {.location = 0});
  std::thread serving([&] { server.run(); });
  patient.join();
  server.interrupt();
  serving.join();
  ::sigaction(SIGUSR1, &before, nullptr);

  EXPECT_FALSE(early);
  EXPECT_GE(endedNs, deadline.ns());
  EXPECT_TRUE(late);
}

}  // namespace
}  // namespace mpf::test
