// SPDX-License-Identifier: MIT
// Callbacks that run the dispatcher, and clients that are destroyed meanwhile.
#include <atomic>
#include <cstdlib>
#include <memory>
#include <thread>
#include <utility>

#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

// A server with a thread of its own.
class NestedRunTest : public testing::Test {
 protected:
  void TearDown() override {
    server_.interrupt();
    thread_.join();
  }

  Watchdog watchdog_{"nested run test"};
  TestBackplane backplane_;
  MessageServer server_{backplane_, "echo"};
  std::thread thread_{[this] {
    server_.on<Int32>([](Int32&) {});
    server_.run();
  }};
};

// The callback returns after the dispatcher has run in it while another thread destroys its client.
TEST_F(NestedRunTest, ADestructorWaitsForACallbackThatRunsTheDispatcher) {
  MessageClient other(backplane_, [](const Message&) {});
  other.bind("absent");
  std::atomic<bool> isInside{false};
  std::atomic<bool> isDestroying{false};
  std::atomic<bool> isDestroyed{false};
  auto client = std::make_unique<MessageClient>(backplane_, [&](const Message&) {
    if (isInside.exchange(true)) return;
    isInside.notify_one();
    isDestroying.wait(false);
    for (int i = 0; i < 50; ++i) static_cast<void>(other.connectWait(1ms));
    EXPECT_FALSE(isDestroyed);
  });
  client->bind("echo");
  isInside.wait(false);

  isDestroying = true;
  isDestroying.notify_one();
  client.reset();

  isDestroyed = true;
}

TEST_F(NestedRunTest, ACallbackMayDestroyTheClientWhoseConnectWaitRunsIt) {
  Dispatcher dispatcher(backplane_);
  std::unique_ptr<MessageClient> client;
  client = std::make_unique<MessageClient>(dispatcher, [&](const Message&) { client.reset(); });
  client->bind("echo");

  EXPECT_FALSE(client->connectWait(1h));

  EXPECT_EQ(client, nullptr);
}

// The thread of the shared dispatcher removes the files; exit() waits for it.
TEST_F(NestedRunTest, AProcessThatExitsDuringItsLastCallbackLeavesNoFiles) {
  MPF_NEEDS_A_CHILD;
  const auto child = inAChild([&] {
    const auto backplane = Backplane::named(backplane_.name());
    std::atomic<bool> isDestroyed{false};
    std::unique_ptr<MessageClient> client;
    client = std::make_unique<MessageClient>(backplane, [&](const Message&) {
      client.reset();
      isDestroyed = true;
      isDestroyed.notify_one();
      std::this_thread::sleep_for(20ms);  // so that an exit that does not wait comes first
    });
    client->bind("echo");
    isDestroyed.wait(false);
    std::exit(0);
  });
  int status = 0;
  ::waitpid(child, &status, 0);

  EXPECT_EQ(status, 0);
  EXPECT_EQ(countNames(backplane_, NameKind::clientWindow), 0);
}

TEST_F(NestedRunTest, ADestroyedClientKeepsNothingOfItsCallback) {
  Dispatcher dispatcher(backplane_);
  auto captured = std::make_shared<int>(1);
  const std::weak_ptr<int> observed = captured;
  auto client = std::make_unique<MessageClient>(dispatcher, [captured](const Message&) {});
  client->bind("echo");
  captured.reset();

  client.reset();

  EXPECT_TRUE(observed.expired());
}

// Each call, and the ones around it. The callback may then run the dispatcher again.
TEST_F(NestedRunTest, AnInterruptEndsEachCallInProgress) {
  Dispatcher dispatcher(backplane_);
  bool wasInside = false;
  MessageClient client(dispatcher, [&](const Message&) {
    static_cast<void>(client.send(Int32Message()));  // messages without end
    if (std::exchange(wasInside, true)) return;
    dispatcher.interrupt();
    EXPECT_FALSE(dispatcher.runOnce());
    EXPECT_TRUE(dispatcher.runOnce());
  });
  client.bind("echo");
  int steps = 0;

  while (steps < 1000 && dispatcher.runOnce()) ++steps;

  EXPECT_TRUE(wasInside);
  EXPECT_LT(steps, 1000);
  EXPECT_TRUE(dispatcher.runOnce()) << "it ends no later call";
}

}  // namespace
}  // namespace mpf::test
