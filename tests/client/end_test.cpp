// SPDX-License-Identifier: MIT
// The ends of links, with messages in transit.
#include <sys/resource.h>

#include <atomic>
#include <filesystem>

#include "shm/watcher.h"
#include "tests/client/client_fixture.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

std::size_t openDescriptors() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
    ++count;
  return count;
}

class EndTest : public ClientTest {
 protected:
  // Another client of the server in this process, connected.
  void withLeaver(const std::function<void(MessageClient&, Dispatcher&)>& work) {
    Dispatcher another(backplane_);
    MessageClient leaver(another, [](const Message&) {});
    leaver.bind("device[0]/a");
    while (!leaver.isConnected()) {
      server_->handleOne();
      another.runOnce(Deadline::after(100us));
    }
    work(leaver, another);
  }
  // Calls `callback` when the process of a client has exited; returns 0 while there is no such
  // client.
  Watcher::Token watch(pid_t process, std::function<void()> callback) {
    for (const auto& name : backplane_.segmentNames()) {
      const auto parsed = SegmentName::tryParse(name);
      if (!parsed || parsed->kind != NameKind::clientWindow) continue;
      auto window = PeerWindow::tryOpen(name, layout::SegmentKind::clientWindow);
      if (window && window->header().ownerPid == process)
        return backplane_.watcher().watchPeer(std::move(window), std::move(callback));
    }
    return 0;
  }
};

// Messages that were sent before an orderly end are received, wherever their bodies are.
TEST_F(EndTest, AReplyInThePoolOfAServerThatEndsArrives) {
  auto& server = startServer();
  const auto held = heldRequest();
  auto reply = server.allocReplyMessage<Float64Array>(held, kBeyondRings);
  std::ranges::fill(reply.value(), 2.5);
  ASSERT_EQ(server.reply(std::move(reply)), ReplyResult::sent);

  server_.reset();

  const auto arrived = next();
  EXPECT_THAT(arrived.valueAs<Float64Array>(),
              testing::AllOf(testing::SizeIs(kBeyondRings), testing::Each(2.5)));
  runUntil([&] { return news_.size() == 2; });
  EXPECT_EQ(protocolErrors(), 0u);
}

// Its memory no longer exists: that is the end of a link, not a protocol error.
TEST_F(EndTest, ARequestInThePoolOfAClientThatEndedIsNoProtocolError) {
  auto& server = startServer();
  int handled = 0;
  server.on<Float64Array>([&](Float64ArrayMessage&&) { ++handled; });
  withLeaver([](auto& leaver, auto&) {
    ASSERT_EQ(leaver.send(leaver.template alloc<Float64Array>(kBeyondRings)), SendResult::sent);
  });

  server.handleOne();

  EXPECT_EQ(handled, 0);
  EXPECT_EQ(protocolErrors(), 0u);
}

// The server does not need the window of a client that has disconnected, although the client's
// process is still running.
TEST_F(EndTest, AServerUnmapsTheWindowsOfClientsThatDisconnected) {
  startServer();
  withLeaver([](auto&, auto&) {});
  server_->handleOne();
  const auto before = openDescriptors();

  for (int i = 0; i < 20; ++i) {
    withLeaver([](auto&, auto&) {});
    server_->handleOne();
  }

  EXPECT_LE(openDescriptors(), before + 4);
}

// Of its peer, each side has the descriptors of a window and of a process.
TEST_F(EndTest, NeitherSideKeepsDescriptorsOfAConnectionThatHasEnded) {
  auto& server = startServer();
  Dispatcher dispatcher(backplane_);
  const auto before = openDescriptors();
  {
    MessageClient client(dispatcher, [](const Message&) {});
    client.bind("device[0]/a");
    while (!client.isConnected()) {
      server.handleOne();
      dispatcher.runOnce(Deadline::after(100us));
    }
    EXPECT_GT(openDescriptors(), before);
  }

  while (sumOf(&layout::WindowControl::linksClosed) != 2) server.handleOne();

  EXPECT_EQ(openDescriptors(), before);
}

// A connect that fails because of missing memory uses up nothing permanently.
TEST_F(EndTest, AFailedConnectUsesUpNoIndex) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer needs the resources that this test uses up";
  startServer();
  static_cast<void>(::signal(SIGXFSZ, SIG_IGN));
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const rlimit little{4096, old.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  std::string reason;
  for (std::uint32_t i = 0; i < layout::kMaxLinks; ++i) {
    MessageClient vain(dispatcher_, [](const Message&) {});
    vain.bind("device[0]/a");
    if (i == 0) reason = vain.notConnectedBecause();
  }
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old), 0);
  EXPECT_THAT(reason, testing::HasSubstr("reserve"));

  client_.bind("device[0]/a");

  EXPECT_THAT(client_.notConnectedBecause(), testing::HasSubstr("not accepted"));
  runUntil([&] {
    return client_.isConnected() ||
           client_.notConnectedBecause().find("which is the maximum") != std::string::npos;
  });
  EXPECT_TRUE(client_.isConnected());
}

// The work of a server, in a process of another user than its client.
TEST(EndOfUsers, AServerAndItsClientOfAnotherUserLeaveNoFiles) {
  MPF_NEEDS_A_CHILD;
  if (::getuid() != 0) GTEST_SKIP() << "needs to be root";
  const Watchdog watchdog("users");
  TestBackplane backplane;
  const auto server = inAChild([&] {
    if (::setgid(65533) != 0 || ::setuid(65533) != 0) ::_exit(1);
    const auto mine = Backplane::named(backplane.name());
    MessageServer own(mine, "device[0]/a", {.rights = {.mode = 0666}});
    bool done = false;
    own.on<Int32>([&](Int32Message&& request) {
      auto reply = own.allocReplyMessage<Float64Array>(request, kBeyondRings);
      static_cast<void>(own.reply(std::move(reply)));
      done = true;
    });
    while (!done && own.waitForMessage()) own.handleOne();
  });
  const auto client = inAChild([&] {
    if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(1);
    const auto mine = Backplane::named(backplane.name());
    SyncClient own(mine, "device[0]/a");
    if (!own.call(Int32Message(), 100s)) ::_exit(2);
    while (own.client().isConnected()) static_cast<void>(own.receive(1ms));
  });
  int status = -1;
  ::waitpid(client, &status, 0);
  EXPECT_EQ(status, 0);
  ::waitpid(server, &status, 0);
  EXPECT_EQ(status, 0);

  EXPECT_THAT(backplane.segmentNames(), testing::IsEmpty());
}

// The server receives the messages in the ring of a client that ended in order, even when the
// process of the client has exited as well.
TEST_F(EndTest, RequestsOfAClientWhoseProcessExitedAreReceived) {
  MPF_NEEDS_A_CHILD;
  auto& server = startServer();
  int handled = 0;
  server.on<Int32>([&](Int32&) { ++handled; });
  const auto child = inAChild([name = backplane_.name()] {
    const auto mine = Backplane::named(name);
    SyncClient own(mine, "device[0]/a");
    if (!own.call(Float64Message(), 100s)) ::_exit(2);
    for (int i = 0; i < 5; ++i) {
      if (own.client().send(Int32Message()) != SendResult::sent) ::_exit(3);
    }
  });
  std::atomic<bool> isNoticed{false};
  Watcher::Token token = 0;
  server.on<Float64>([&](Float64&) {
    token = watch(child, [&] {
      isNoticed = true;
      isNoticed.notify_one();
    });
  });
  while (token == 0) server.handleOne();
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  isNoticed.wait(false);  // the server notices it with its next receive()

  while (handled < 5) server.handleOne();

  backplane_.watcher().forget(token);
}

// One of them was in memory that no longer exists; the others were not.
TEST_F(EndTest, RequestsAfterALargeRequestOfAClientThatEndedAreReceived) {
  auto& server = startServer();
  int handled = 0;
  server.on<Int32>([&](Int32&) { ++handled; });
  server.on<Float64Array>([&](Float64ArrayMessage&&) {});
  withLeaver([](auto& leaver, auto&) {
    ASSERT_EQ(leaver.send(Int32Message()), SendResult::sent);
    ASSERT_EQ(leaver.send(leaver.template alloc<Float64Array>(kBeyondRings)), SendResult::sent);
    ASSERT_EQ(leaver.send(Int32Message()), SendResult::sent);
  });

  for (int i = 0; i < 10; ++i) server.handleOne();

  EXPECT_EQ(handled, 2);
}

// A callback may wait for another client's connection: the dispatcher then runs within the end of
// this one.
TEST_F(EndTest, ACallbackThatRunsTheDispatcherGetsAllMessagesOfADisconnect) {
  std::vector<int> told;  // 0: a fate, 1: connected, 2: disconnected
  bool nested = false;
  auto& server = startServer();
  std::vector<Message> held;
  server.on<Int32>([&](Int32Message&& request) { held.push_back(std::move(request)); });
  MessageClient other(dispatcher_, [](const Message&) {});
  other.bind("absent");
  MessageClient client(dispatcher_, [&](const Message& message) {
    if (const auto* connect = message.tryAs<Connect>()) {
      told.push_back(connect->status == ConnectStatus::connectYes ? 1 : 2);
    } else {
      told.push_back(0);
      if (!std::exchange(nested, true)) static_cast<void>(other.connectWait(20ms));
    }
  });
  client.bind("device[0]/a");
  runUntil([&] { return client.isConnected(); });
  for (int i = 0; i < 3; ++i) ASSERT_EQ(client.send(Int32Message()), SendResult::sent);
  runUntil([&] { return held.size() == 3; });

  server_.reset();
  startServer();
  runUntil([&] { return !told.empty() && told.back() == 1 && told.size() > 1; });

  EXPECT_THAT(told, testing::ElementsAre(1, 0, 0, 0, 2, 1));
  held.clear();
}

// A server object follows another one in the same process, and a handle of a request to the first
// still exists.
TEST_F(EndTest, ANewServerCannotReplyToARequestOfTheFormerServer) {
  startServer();
  auto held = heldRequest();
  server_.reset();
  auto& successor = startServer();
  EXPECT_EQ(fateOf(next()), Fate::outcomeUnknown);
  runUntil([&] { return news_.size() == 3; });

  EXPECT_EQ(successor.reply(std::move(held)), ReplyResult::clientGone);
  for (int i = 0; i < 10; ++i) {
    server_->handleOne();
    dispatcher_.runOnce(Deadline::after(1ms));
  }
}

}  // namespace
}  // namespace mpf::test
