// SPDX-License-Identifier: MIT
// The ends of links: no descriptors left, paused clients, callbacks that run the dispatcher.
#include <fcntl.h>
#include <sys/inotify.h>

#include <array>
#include <atomic>
#include <thread>

#include <mpf/file_descriptor.h>

#include "tests/client/client_fixture.h"
#include "tests/support/no_descriptors.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

using EndMoreTest = ClientTest;

// A request whose memory cannot be mapped because no descriptor is left is not a protocol error.
TEST_F(EndMoreTest, AServerWithoutDescriptorsKeepsTheClientOfALargeRequest) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer needs the resources that this test uses up";
  auto& server = startServer();
  server.on<Float64Array>([](Float64Array&) {});
  bind();
  ASSERT_EQ(client_.send(client_.alloc<Float64Array>(kBeyondRings)), SendResult::sent);
  {
    const NoDescriptors now;
    for (int i = 0; i < 5; ++i) server.handleOne();
  }

  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_EQ(protocolErrors(), 0u);
  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes));
}

// A link that cannot be mapped is not a protocol error either.
TEST_F(EndMoreTest, AServerWithoutDescriptorsAcceptsItsClientLater) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer needs the resources that this test uses up";
  auto& server = startServer();
  client_.bind("device[0]/a");
  {
    const NoDescriptors now;
    server.handleOne();
  }

  EXPECT_EQ(protocolErrors(), 0u);
  runUntil([&] { return client_.isConnected(); });
}

// A reply whose memory cannot be mapped is not a protocol error either.
TEST_F(EndMoreTest, AClientWithoutDescriptorsKeepsTheServerOfALargeReply) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer needs the resources that this test uses up";
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    auto reply = server.allocReplyMessage<Float64Array>(request, kBeyondRings);
    static_cast<void>(server.reply(std::move(reply)));
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  while (!server.handleOne()) {
  }
  {
    const NoDescriptors now;
    for (int i = 0; i < 5; ++i) dispatcher_.runOnce(Deadline::after(1ms));
  }

  EXPECT_EQ(fateOf(next()), Fate::outcomeUnknown);
  EXPECT_EQ(protocolErrors(), 0u);
  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes));
}

// A client that is destroyed within its callback stays alive until that returns, although the
// callback runs the dispatcher.
TEST_F(EndMoreTest, AClientDestroyedInACallbackThatRunsTheDispatcherStaysAliveUntilItReturns) {
  startServer().on<Int32>([](Int32&) {});
  MessageClient other(dispatcher_, [](const Message&) {});
  other.bind("absent");
  std::unique_ptr<MessageClient> client;
  bool done = false;
  const std::string canary(1000, 'x');
  client = std::make_unique<MessageClient>(dispatcher_, [&, canary](const Message& message) {
    if (message.tryAs<Connect>() != nullptr) return;
    client.reset();
    static_cast<void>(other.connectWait(5ms));
    EXPECT_EQ(canary, std::string(1000, 'x'));
    done = true;
  });
  client->bind("device[0]/a");
  runUntil([&] { return client->isConnected(); });
  ASSERT_EQ(client->send(Int32Message()), SendResult::sent);

  runUntil([&] { return done; });
}

// After resume(), a paused client gets the messages that were sent before the end, then the
// disconnect, then the connection to the next server.
TEST_F(EndMoreTest, APausedClientGetsTheMessagesThatItsServerSentBeforeItEnded) {
  auto& server = startServer();
  server.on<Int32>([&](Int32Message&& request) {
    for (int i = 0; i < 3; ++i) {
      auto reply = server.allocReplyMessage<Float64Array>(request, kBeyondRings << i);
      static_cast<void>(server.reply(std::move(reply)));
    }
    static_cast<void>(server.reply(std::move(request)));
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  client_.pause();
  while (!server.handleOne()) {
  }
  server_.reset();
  startServer();
  for (int i = 0; i < 5; ++i) dispatcher_.runOnce(Deadline::after(1ms));
  EXPECT_THAT(messages_, testing::IsEmpty());

  client_.resume();

  for (int i = 0; i < 3; ++i)
    EXPECT_THAT(next().valueAs<Float64Array>(), testing::SizeIs(kBeyondRings << i));
  EXPECT_NE(next().tryAs<Int32>(), nullptr);
  runUntil([&] { return news_.size() == 3; });
  EXPECT_EQ(protocolErrors(), 0u);
}

// A handle keeps a link alive after its server has ended; its client dies before it has seen that
// end. The last handle removes the link.
TEST_F(EndMoreTest, AHandleThatOutlivesItsServerAndItsClientLeavesNoPool) {
  MPF_NEEDS_A_CHILD;
  auto& server = startServer();
  Message held;
  server.on<Int32>([&](Int32Message&& request) {
    held = server.allocReplyMessage<Float64Array>(request, kBeyondRings);
    static_cast<void>(server.reply(std::move(request)));
  });
  std::array<int, 2> told{};
  checkCall(::pipe2(told.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor heard(told[0]);
  const FileDescriptor says(told[1]);
  const auto child = inAChild([&] {
    SyncClient own(Backplane::named(backplane_.name()), "device[0]/a");
    static_cast<void>(own.call(Int32Message(), 100s));
    static_cast<void>(::write(says.get(), "!", 1));
    for (;;) ::pause();  // never reads its messages again
  });
  while (!held) server.handleOne();
  char byte = 0;
  ASSERT_EQ(::read(heard.get(), &byte, 1), 1);  // it has received its reply
  server_.reset();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);

  held.reset();

  EXPECT_EQ(countNames(backplane_, NameKind::bulk), 0);
}

// An inotify instance that reports removed names. A user has few of them, and parallel tests use
// some: it waits for one.
FileDescriptor watchRemovals() {
  FileDescriptor watch;
  while (!watch) {
    watch.reset(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
    if (!watch && errno != EMFILE) throwSystemError(errno, "inotify_init1", "the test");
    std::this_thread::yield();
  }
  checkCall(::inotify_add_watch(watch.get(), "/dev/shm", IN_DELETE), "inotify_add_watch",
            "/dev/shm");
  return watch;
}

// A process that is killed during the removal leaves no gap in the numbers, where a search would
// end.
TEST_F(EndMoreTest, NamesOfAPoolAreRemovedLastOneFirst) {
  startServer().on<Float64Array>([](Float64Array&) {});
  std::optional<MessageClient> leaver(std::in_place, dispatcher_, [this](Message&& message) {
    messages_.push_back(std::move(message));
  });
  leaver->bind("device[0]/a");
  runUntil([&] { return leaver->isConnected(); });
  messages_.clear();
  for (int i = 0; i < 2; ++i)
    ASSERT_EQ(leaver->send(leaver->alloc<Float64Array>(kBeyondRings << (4 * i))), SendResult::sent);
  for (int i = 0; i < 2; ++i) EXPECT_NE(next().tryAs<Float64Array>(), nullptr);
  const auto watch = watchRemovals();

  leaver.reset();

  std::vector<std::string> removed;
  alignas(inotify_event) std::array<char, 65536> events{};
  for (ssize_t bytes = 0; (bytes = ::read(watch.get(), events.data(), events.size())) > 0;) {
    for (ssize_t at = 0; at < bytes;) {
      const auto* event = reinterpret_cast<const inotify_event*>(events.data() + at);
      const std::string name(event->name);
      if (name.starts_with(SegmentName::prefix(backplane_.name())) &&
          SegmentName::tryParse(name)->kind == NameKind::bulk)
        removed.push_back(name);
      at += static_cast<ssize_t>(sizeof *event + event->len);
    }
  }
  EXPECT_THAT(removed, testing::ElementsAre(testing::EndsWith(".0.1"), testing::EndsWith(".0.0")));
}

// The callback of a disconnect may wait for the next connection.
TEST_F(EndMoreTest, ACallbackMayWaitForTheNextConnection) {
  startServer().on<Int32>([](Int32&) {});
  int connects = 0;
  int replies = 0;
  std::unique_ptr<MessageClient> client;
  client = std::make_unique<MessageClient>(dispatcher_, [&](const Message& message) {
    if (message.tryAs<Int32>() != nullptr) ++replies;
    const auto* connect = message.tryAs<Connect>();
    if (connect == nullptr) return;
    if (connect->status == ConnectStatus::connectYes) ++connects;
    if (connect->status == ConnectStatus::connectNo) static_cast<void>(client->connectWait(300ms));
  });
  client->bind("device[0]/a");
  runUntil([&] { return connects == 1; });
  serverRuns_ = false;
  ASSERT_EQ(client->send(Int32Message()), SendResult::sent);
  server_.reset();
  startServer().on<Int32>([](Int32&) {});
  serverRuns_ = true;

  runUntil([&] { return client->isConnected() && connects == 2; });
  ASSERT_EQ(client->send(Int32Message()), SendResult::sent);
  runUntil([&] { return replies == 1; });
  for (int i = 0; i < 20; ++i) {
    server_->handleOne();
    dispatcher_.runOnce(Deadline::after(1ms));
  }

  EXPECT_TRUE(client->isConnected());
  EXPECT_EQ(countNames(backplane_, NameKind::link), 1);
  EXPECT_EQ(sumOf(&layout::WindowControl::linkCount), 2u)
      << "the client's end and the server's end";
}

// Another thread binds a client while the dispatcher delivers a disconnect, after which it looks
// for servers by itself.
TEST(EndOfOthers, AClientThatIsBoundDuringADisconnectConnectsOnce) {
  MPF_NEEDS_A_CHILD;
  const Watchdog watchdog("bind during a disconnect");
  TestBackplane backplane;
  const auto child = inAChild([&] {
    MessageServer mortal(Backplane::named(backplane.name()), "mortal");
    mortal.run();
  });
  {
    MessageServer server(backplane, "device[0]/a");
    server.on<Int32>([](Int32&) {});
    std::atomic<int> replies{0};
    std::atomic<bool> blocked{false};
    std::atomic<bool> goesOn{false};
    MessageClient first(backplane, [&](const Message& message) {
      const auto* connect = message.tryAs<Connect>();
      if (connect == nullptr || connect->status != ConnectStatus::connectNo) return;
      blocked = true;
      blocked.notify_one();
      goesOn.wait(false);
    });
    MessageClient second(backplane, [&](const Message& message) {
      replies += message.tryAs<Int32>() != nullptr ? 1 : 0;
    });
    first.bind("mortal");
    EXPECT_TRUE(first.connectWait(100s));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    blocked.wait(false);

    second.bind("device[0]/a");
    goesOn = true;
    goesOn.notify_one();

    while (!second.isConnected()) server.handleOne();
    const auto window =
        PeerWindow::tryOpen(SegmentName::serverWindow(backplane.name(), 0, "device[0]/a"),
                            layout::SegmentKind::serverWindow);
    EXPECT_EQ(second.send(Int32Message()), SendResult::sent);
    while (replies == 0) server.handleOne();
    EXPECT_EQ(countNames(backplane, NameKind::link), 1);
    EXPECT_EQ(window->control().linkCount.load(), 1u);
  }
}

}  // namespace
}  // namespace mpf::test
