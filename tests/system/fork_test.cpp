// SPDX-License-Identifier: MIT
// A program forks without exec: the child keeps no dead owner alive, does not change the objects of
// its parent, and may create its own.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <thread>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "base/system_call.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/shm/child.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class ForkTest : public testing::Test {
 protected:
  // An echo server with a thread, a client of it on the dispatcher thread of the process, and a
  // client without a thread.
  void SetUp() override {
    server_->on<Float64>([](Float64& request) { request.value += 1; });
    thread_ = std::thread([this] { server_->run(); });
    client_ = std::make_unique<MessageClient>(backplane_, [](const Message&) {});
    client_->bind("echo");
    ASSERT_TRUE(client_->connectWait(60s));
    sync_.emplace(backplane_, "echo");
    expectAnswer(*sync_);
  }
  void TearDown() override {
    sync_.reset();
    client_.reset();
    server_->interrupt();
    thread_.join();
    server_.reset();
  }
  static void expectAnswer(SyncClient& client) {
    auto answer = client.call(Float64Message({.value = 1}), 60s);
    ASSERT_TRUE(answer) << answer.why();
    EXPECT_EQ(answer.message().tryAs<Float64>()->value, 2);
  }
  // Runs `act` in a child; returns its exit status, 0 without failures.
  static int inChild(const std::function<void()>& act) {
    const auto pid = checkCall(::fork(), "fork");
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      act();
      ::_exit(testing::Test::HasFailure() ? 1 : 0);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
  }

  Watchdog watchdog_{"fork test"};
  TestBackplane backplane_;
  std::unique_ptr<MessageServer> server_ = std::make_unique<MessageServer>(backplane_, "echo");
  std::thread thread_;
  std::unique_ptr<MessageClient> client_;
  std::optional<SyncClient> sync_;
};

TEST_F(ForkTest, InheritedObjectsRefuseUseInAChild) {
  Dispatcher dispatcher(backplane_);
  const auto status = inChild([&] {
    EXPECT_THROW(MessageClient(dispatcher, [](const Message&) {}), std::logic_error);
    EXPECT_THROW(dispatcher.runOnce(), std::logic_error);
    EXPECT_FALSE(client_->isConnected());
    EXPECT_EQ(client_->send(Float64Message({.value = 1})), SendResult::notConnected);
    EXPECT_THAT(client_->notConnectedBecause(), testing::HasSubstr("made before a fork"));
    EXPECT_FALSE(client_->connectWait(60s));
    EXPECT_EQ(sync_->call(Float64Message({.value = 1}), 60s).refusal(), SendResult::notConnected);
    EXPECT_THROW(server_->waitForMessage(), std::logic_error);
    EXPECT_THROW(server_->receive(), std::logic_error);
    EXPECT_THROW(server_->run(), std::logic_error);
    EXPECT_THROW(static_cast<void>(server_->descriptor()), std::logic_error);
    EXPECT_THROW(server_->setQueueSize(7), std::logic_error);
    EXPECT_THROW(server_->report(), std::logic_error);
  });

  EXPECT_EQ(status, 0);
  expectAnswer(*sync_);
}

TEST_F(ForkTest, AChildThatDestroysObjectsDoesNotChangeTheParents) {
  const auto names = backplane_.segmentNames();

  const auto status = inChild([&] {
    EXPECT_EQ(client_->alloc<Float64Array>(100'000).getLength(), 100'000u);
    sync_.reset();
    client_.reset();
    server_.reset();
  });

  EXPECT_EQ(status, 0);
  EXPECT_THAT(backplane_.segmentNames(), testing::UnorderedElementsAreArray(names));
  EXPECT_TRUE(client_->isConnected());
  expectAnswer(*sync_);
}

TEST_F(ForkTest, AChildMayDestroyAClientThatAThreadOfItsParentWaitsFor) {
  auto dispatcher = std::make_unique<Dispatcher>(backplane_);
  auto client = std::make_unique<MessageClient>(*dispatcher, [](const Message&) {});
  client->bind("absent");
  std::thread running([&] { dispatcher->run(); });
  std::atomic<bool> isOver{false};
  std::thread waiting([&] {
    while (!isOver) static_cast<void>(client->connectWait(1s));
  });

  for (int i = 0; i < 20; ++i) {
    const auto status = inChild([&] {
      ::alarm(60);
      client.reset();
      dispatcher.reset();
    });
    EXPECT_EQ(status, 0);
  }

  isOver = true;
  waiting.join();
  dispatcher->interrupt();
  running.join();
}

TEST_F(ForkTest, AChildCannotReplyToARequestOfItsParent) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer allows no threads in the child of a process that has some";
#endif
  MessageServer server(backplane_, "parent");
  SyncClient client(backplane_, "parent");
  std::thread calling([&] { EXPECT_TRUE(client.call(Float64Message({.value = 1}), 60s)); });
  Message request;
  while (!(request = server.receive())) server.waitForMessage();

  const auto status = inChild([&] {
    MessageServer own(backplane_, "child");
    auto reply = own.allocReplyMessage<Float64Array>(request, 1000);
    EXPECT_EQ(own.reply(std::move(reply)), ReplyResult::clientGone);
    const std::vector<Float64> values(3);
    EXPECT_EQ(own.replyMany<Float64>(request, values).count, 0u);
  });

  EXPECT_EQ(status, 0);
  EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent);
  calling.join();
}

TEST_F(ForkTest, AChildMayCreateItsOwnObjects) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer allows no threads in the child of a process that has some";
#endif
  const auto status = inChild([&] {
    SyncClient own(backplane_, "echo");
    expectAnswer(own);
    MessageClient shared(backplane_, [](const Message&) {});
    shared.bind("echo");
    EXPECT_TRUE(shared.connectWait(60s));
    const MessageServer server(backplane_, "child");
  });

  EXPECT_EQ(status, 0);
  expectAnswer(*sync_);
}

TEST_F(ForkTest, TheDeathOfAServerIsNoticedWhileItsChildIsAlive) {
  const auto mortal = std::make_unique<Child>([&](Child::Self& self) {
    const MessageServer server(Backplane::named(backplane_.name()), "mortal");
    if (::fork() == 0) {
      ::prctl(PR_SET_PDEATHSIG, 0);
      self.ready();  // runs until the test lets it continue
      ::_exit(0);
    }
    ::pause();
  });
  const auto window = SegmentName::serverWindow(backplane_.name(), 0, "mortal");
  ASSERT_EQ(segments::probeOwner(window), segments::Owner::alive);

  ::kill(mortal->pid(), SIGKILL);

  while (segments::probeOwner(window) == segments::Owner::alive) std::this_thread::yield();
  const MessageServer successor(backplane_, "mortal");
  mortal->go();
  EXPECT_EQ(successor.getName(), "mortal");
}

}  // namespace
}  // namespace mpf::test
