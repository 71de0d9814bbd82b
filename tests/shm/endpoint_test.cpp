// SPDX-License-Identifier: MIT
// Endpoint: a window with its links, and the wait for the next message of any of them.
#include <poll.h>
#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <thread>

#include "tests/shm/child.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/wait_modes.h"

namespace mpf::test {
namespace {

class EndpointTest : public ShmTest {
 protected:
  // Takes `messages` messages from `end` while all links are kept full. Returns how many came from
  // each of `links`.
  static std::vector<int> shares(End& end, const std::vector<Connected>& links, int messages) {
    std::vector<int> taken(links.size());
    for (int i = 0; i < messages; ++i) {
      for (const auto& link : links) static_cast<void>(send(link.client, 1));
      auto* const ready = end.endpoint.next();
      if (ready == nullptr || !End::tryTake(*ready)) continue;
      const auto isIt = [&](const auto& link) { return link.get() == ready; };
      ++taken[static_cast<std::size_t>(std::ranges::find_if(end.links, isIt) - end.links.begin())];
    }
    return taken;
  }
};

class WaitModes : public EndpointTest, public testing::WithParamInterface<WaitMode> {};
INSTANTIATE_TEST_SUITE_P(All, WaitModes, kWaitModes, nameOfWaitMode);

TEST_P(WaitModes, AWaitEndsWithAMessage) {
  End server(backplane_, "server", GetParam());
  End client(backplane_, "", GetParam());
  const auto link = connect(client, server);
  while (server.endpoint.next()) {
  }
  std::thread sender([&] { EXPECT_EQ(send(link.client, 7), LinkSend::sent); });

  const bool hasEvent = server.endpoint.wait(Deadline::never());
  sender.join();

  EXPECT_TRUE(hasEvent);
  ASSERT_EQ(server.endpoint.next(), &link.server);
  EXPECT_EQ(End::tryTake(link.server), 7u);
}

TEST_P(WaitModes, AWaitWithoutAMessageEndsAtItsDeadline) {
  End server(backplane_, "server", GetParam());

  for (const auto patience : {-1ms, 0ms, 3ms}) {
    const auto deadline = Deadline::after(patience);
    EXPECT_FALSE(server.endpoint.wait(deadline));
    EXPECT_TRUE(deadline.hasPassed());
  }
}

TEST_P(WaitModes, AnInterruptFromAnotherThreadEndsAWait) {
  End server(backplane_, "server", GetParam());
  std::thread other([&] { server.endpoint.interrupt(); });

  EXPECT_TRUE(server.endpoint.wait(Deadline::never()));
  other.join();

  EXPECT_TRUE(server.endpoint.takeLocalEvent());
  EXPECT_FALSE(server.endpoint.takeLocalEvent());
}

TEST_P(WaitModes, AnInterruptBeforeAWaitEndsIt) {
  End server(backplane_, "server", GetParam());

  server.endpoint.interrupt();

  EXPECT_TRUE(server.endpoint.wait(Deadline::never()));
}

TEST_P(WaitModes, AnInterruptFromASignalHandlerEndsAWait) {
#ifdef __SANITIZE_THREAD__
  if (GetParam() != WaitMode::spin)
    GTEST_SKIP()
        << "ThreadSanitizer delays signal handlers until the sleep that they must end has ended";
#endif
  End server(backplane_, "server", GetParam());
  static Endpoint* interrupted = nullptr;
  interrupted = &server.endpoint;
  struct sigaction action{};
  action.sa_handler = [](int) { interrupted->interrupt(); };
  action.sa_flags = SA_RESTART;
  struct sigaction before{};
  ::sigaction(SIGUSR1, &action, &before);
  std::atomic<bool> waiting{false};
  std::thread waiter([&] {
    waiting = true;
    EXPECT_TRUE(server.endpoint.wait(Deadline::never()));
  });
  while (!waiting) std::this_thread::yield();

  ::pthread_kill(waiter.native_handle(), SIGUSR1);

  waiter.join();
  ::sigaction(SIGUSR1, &before, nullptr);
}

TEST_P(WaitModes, ThousandsOfTurnsLoseNoWakeUp) {
  constexpr std::uint32_t kTurns = 5000;
  End server(backplane_, "server", GetParam());
  End client(backplane_, "", GetParam());
  const auto link = connect(client, server);
  const auto takeNext = [](End& end) {
    for (;;) {
      if (auto* const ready = end.endpoint.next()) {
        if (const auto id = End::tryTake(*ready)) return *id;
        continue;
      }
      EXPECT_TRUE(end.endpoint.wait(Deadline::never()));
    }
  };

  std::thread echo([&] {
    for (std::uint32_t turn = 0; turn < kTurns; ++turn)
      EXPECT_EQ(send(link.server, takeNext(server)), LinkSend::sent);
  });
  for (std::uint32_t turn = 0; turn < kTurns; ++turn) {
    EXPECT_EQ(send(link.client, turn), LinkSend::sent);
    ASSERT_EQ(takeNext(client), turn);
  }
  echo.join();
}

TEST_F(EndpointTest, LinksTakeTurns) {
  End server(backplane_, "server");
  End client(backplane_, "");
  std::vector<Connected> links;
  for (int i = 0; i < 3; ++i) links.push_back(connect(client, server));

  const auto taken = shares(server, links, 3000);

  for (const auto share : taken) EXPECT_NEAR(share, 1000, 50);
}

// With more busy links than the endpoint polls.
TEST_F(EndpointTest, MoreBusyLinksThanArePolledTakeTurns) {
  constexpr int kLinks = 20;
  constexpr int kEach = 2000;
  End server(backplane_, "server");
  End client(backplane_, "");
  std::vector<Connected> links;
  for (int i = 0; i < kLinks; ++i) links.push_back(connect(client, server));

  const auto taken = shares(server, links, kLinks * kEach);

  const auto [least, most] = std::minmax_element(taken.begin(), taken.end());
  EXPECT_GE(*least, kEach / 2);
  EXPECT_LE(*most, kEach * 2);
}

// A caller that waits before each message gets all messages, also those of a link that is not
// polled because other links are.
TEST_F(EndpointTest, AWaitBeforeEachMessageReturnsForEveryMessage) {
  constexpr std::uint32_t kLinks = 9;
  End server(backplane_, "server");
  End client(backplane_, "");
  std::vector<Connected> links;
  for (std::uint32_t i = 0; i < kLinks; ++i) links.push_back(connect(client, server));
  while (server.endpoint.next()) {
  }
  for (std::uint32_t i = 0; i < 5; ++i) ASSERT_EQ(send(links.back().client, i), LinkSend::sent);

  for (std::uint32_t taken = 0; taken < 5;) {
    ASSERT_TRUE(server.endpoint.wait(Deadline::never()));
    if (auto* const ready = server.endpoint.next(); ready && End::tryTake(*ready)) ++taken;
  }
}

TEST_F(EndpointTest, AFloodOnOneLinkDoesNotStarveOthers) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto flood = connect(client, server);
  const auto quiet = connect(client, server);
  shares(server, {flood}, 10'000);

  ASSERT_EQ(send(quiet.client, 7), LinkSend::sent);
  int others = 0;
  for (bool found = false; !found;) {
    static_cast<void>(send(flood.client, 1));
    auto* const ready = server.endpoint.next();
    ASSERT_NE(ready, nullptr);
    const auto id = End::tryTake(*ready);
    found = id && ready == &quiet.server;
    if (id && !found) ++others;
  }

  EXPECT_LE(others, 20);
}

// More busy links than the endpoint polls, and a link whose ready bit is in another word.
TEST_F(EndpointTest, BusyLinksDoNotStarveALinkWithAHighIndex) {
  End server(backplane_, "server");
  End client(backplane_, "");
  std::vector<Connected> links;
  while (links.size() < 2 * HotLinks::kCapacity) links.push_back(connect(client, server));
  for (int i = 0; i < 60; ++i) connect(client, server);
  const auto quiet = connect(client, server);
  shares(server, links, 1000);

  ASSERT_EQ(send(quiet.client, 7), LinkSend::sent);
  const auto taken = [&] { return quiet.server.incoming().messages() != 0; };
  for (int turns = 0; turns < 1000 && !taken(); ++turns) {
    for (const auto& link : links) static_cast<void>(send(link.client, 1));
    if (auto* const ready = server.endpoint.next()) End::tryTake(*ready);
  }

  EXPECT_TRUE(taken());
}

TEST_F(EndpointTest, DoesNotLookAtIdleLinks) {
  End server(backplane_, "server");
  End client(backplane_, "");
  for (int i = 0; i < 100; ++i) connect(client, server);
  for (int i = 0; i < 1'000'000 && server.endpoint.next(); ++i) {
  }

  EXPECT_FALSE(server.endpoint.next());
  EXPECT_FALSE(server.endpoint.wait(Deadline::after(1ms)));
  EXPECT_EQ(server.endpoint.control().linkCount.load(std::memory_order_relaxed), 100u);
}

TEST_F(EndpointTest, ReusesTheBitOfADetachedLink) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto first = connect(client, server);
  ASSERT_EQ(send(first.client, 1), LinkSend::sent);

  server.drop(first.serverIndex);
  EXPECT_FALSE(server.endpoint.next()) << "the messages of the detached link are gone";
  const auto second = connect(client, server);

  EXPECT_EQ(second.serverIndex, first.serverIndex);
  ASSERT_EQ(send(second.client, 2), LinkSend::sent);
  ASSERT_EQ(server.endpoint.next(), &second.server);
  EXPECT_EQ(End::tryTake(second.server), 2u);
  EXPECT_EQ(server.endpoint.control().linkCount.load(std::memory_order_relaxed), 1u);
}

TEST_F(EndpointTest, ReservesNoMoreBitsThanTheLayoutHas) {
  End server(backplane_, "server");

  for (std::uint32_t i = 0; i < layout::kMaxLinks; ++i) ASSERT_EQ(server.endpoint.tryReserve(), i);

  EXPECT_FALSE(server.endpoint.tryReserve());
  server.endpoint.detach(7);
  EXPECT_EQ(server.endpoint.tryReserve(), 7u);
}

TEST_F(EndpointTest, AKnockIsAControlEvent) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto peer =
      client.endpoint.peers().tryOpen(serverName(), layout::SegmentKind::serverWindow);
  EXPECT_FALSE(server.endpoint.hasControlEvents());

  peer->knock(5);

  EXPECT_TRUE(server.endpoint.wait(Deadline::never()));
  EXPECT_TRUE(server.endpoint.hasControlEvents());
  EXPECT_EQ(server.endpoint.knocks().tryTake(), 5u);
  EXPECT_FALSE(server.endpoint.knocks().tryTake());
  EXPECT_FALSE(server.endpoint.hasControlEvents());
  peer->knock(5 + layout::kKnocks);
  peer->knock(5);
  EXPECT_TRUE(server.endpoint.knocks().takeRescan());
}

TEST_F(EndpointTest, OpensTheProcessOfANewPeerBesideItsMessages) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto link = connect(client, server);
  EXPECT_FALSE(link.client.peer()->process());

  static_cast<void>(client.endpoint.next());

  EXPECT_TRUE(link.client.peer()->process());
}

TEST_F(EndpointTest, ReportsAPeersDeathAsALocalEvent) {
  Child child([&](Child::Self& self) {
    const OwnWindow window(name(), layout::SegmentKind::serverWindow, serverName(), {},
                           [](layout::SegmentHeader&) {});
    self.stay();
  });
  End client(backplane_, "");
  const auto peer =
      client.endpoint.peers().tryOpen(serverName(), layout::SegmentKind::serverWindow);

  child.end(SIGKILL);

  while (!client.endpoint.takePeerDeath()) ASSERT_TRUE(client.endpoint.wait(Deadline::never()));
  EXPECT_TRUE(client.endpoint.takeLocalEvent());
  EXPECT_TRUE(peer->isDead());
}

TEST_F(EndpointTest, DescriptorIsReadableWhenAMessageArrives) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto link = connect(client, server);
  const auto isReadable = [&] {
    pollfd poll{server.endpoint.descriptor(), POLLIN, 0};
    return ::poll(&poll, 1, 0) == 1;
  };
  while (server.endpoint.next()) {
  }
  ASSERT_TRUE(server.endpoint.arm());
  EXPECT_FALSE(isReadable());

  ASSERT_EQ(send(link.client, 7), LinkSend::sent);

  EXPECT_TRUE(isReadable());
  EXPECT_FALSE(server.endpoint.arm()) << "there is a message already";
  ASSERT_EQ(server.endpoint.next(), &link.server);
  EXPECT_EQ(End::tryTake(link.server), 7u);
  while (server.endpoint.next()) {
  }
  ASSERT_TRUE(server.endpoint.arm());
  EXPECT_FALSE(isReadable());
  server.endpoint.interrupt();
  EXPECT_TRUE(isReadable());
  server.endpoint.disarm();
}

TEST_F(EndpointTest, AnEndpointThatIsPolledNeedsNoWakeUp) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto link = connect(client, server);
  const auto isReadable = [&] {
    pollfd poll{server.endpoint.descriptor(), POLLIN, 0};
    return ::poll(&poll, 1, 0) == 1;
  };
  const auto take = [&] {
    ASSERT_EQ(server.endpoint.next(), &link.server);
    EXPECT_EQ(End::tryTake(link.server), 7u);
    while (server.endpoint.next()) {
    }
  };
  while (server.endpoint.next()) {
  }
  server.endpoint.setPolled(true);
  EXPECT_TRUE(server.endpoint.arm());

  ASSERT_EQ(send(link.client, 7), LinkSend::sent);

  EXPECT_FALSE(isReadable());
  EXPECT_TRUE(server.endpoint.arm()) << "whatever has arrived";
  take();
  EXPECT_EQ(server.endpoint.control().sleeping.load(), layout::SleepState::awake);
  ASSERT_EQ(send(link.client, 7), LinkSend::sent);
  server.endpoint.setPolled(false);
  EXPECT_FALSE(server.endpoint.arm()) << "there is a message already";
  take();
  ASSERT_TRUE(server.endpoint.arm());
  ASSERT_EQ(send(link.client, 7), LinkSend::sent);
  EXPECT_TRUE(isReadable());
  server.endpoint.disarm();
}

TEST_F(EndpointTest, ThousandsOfTurnsInAnEventLoopLoseNoWakeUps) {
  constexpr std::uint32_t kTurns = 5000;
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto link = connect(client, server);
  const auto takeNext = [](End& end) {
    for (;;) {
      while (auto* const ready = end.endpoint.next()) {
        if (const auto id = End::tryTake(*ready)) return *id;
      }
      if (!end.endpoint.arm()) continue;
      pollfd poll{end.endpoint.descriptor(), POLLIN, 0};
      while (::poll(&poll, 1, -1) < 0) {
      }
    }
  };

  std::thread echo([&] {
    for (std::uint32_t turn = 0; turn < kTurns; ++turn)
      EXPECT_EQ(send(link.server, takeNext(server)), LinkSend::sent);
  });
  for (std::uint32_t turn = 0; turn < kTurns; ++turn) {
    EXPECT_EQ(send(link.client, turn), LinkSend::sent);
    ASSERT_EQ(takeNext(client), turn);
  }
  echo.join();
}

}  // namespace
}  // namespace mpf::test
