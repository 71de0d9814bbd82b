// SPDX-License-Identifier: MIT
// Lost hints, and hints without a message: they cost time, but no message is lost and no other link
// is affected.
#include <poll.h>

#include <atomic>
#include <thread>

#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/random.h"
#include "tests/support/wait_modes.h"

namespace mpf::test {
namespace {

constexpr std::uint32_t kUnusedBit = 9999;
constexpr int kUntilCool = 5000;  // after so many polls without a message, no link is polled

class HintsTest : public ShmTest {
 protected:
  // Lets the server poll until it finds links only by their hints.
  static void coolDown(End& end) {
    for (int i = 0; i < kUntilCool; ++i) static_cast<void>(end.endpoint.next());
  }
  static void loseHints(End& end) {
    auto& hints = end.endpoint.window().hints();
    for (auto& word : hints.readyWords) word.store(0, std::memory_order_relaxed);
    for (auto& bits : hints.readyBits) bits.store(0, std::memory_order_relaxed);
  }
  static void inventHints(End& end) {
    auto& hints = end.endpoint.window().hints();
    for (auto& word : hints.readyWords) word.store(UINT64_MAX, std::memory_order_relaxed);
    for (auto& bits : hints.readyBits) bits.store(UINT64_MAX, std::memory_order_relaxed);
    for (auto& knock : hints.knocks) knock.store(UINT64_MAX, std::memory_order_relaxed);
    hints.knocked.store(UINT32_MAX, std::memory_order_relaxed);
    hints.rescan.store(UINT32_MAX, std::memory_order_relaxed);
  }
  // The next message of any link; waits without a limit.
  static std::uint32_t take(End& end) {
    for (;;) {
      if (auto* const ready = end.endpoint.next()) {
        if (const auto id = End::tryTake(*ready)) return *id;
        continue;
      }
      while (end.endpoint.knocks().tryTake()) {
      }
      static_cast<void>(end.endpoint.knocks().takeRescan());
      EXPECT_TRUE(end.endpoint.wait(Deadline::never()));
    }
  }
};

class LostHints : public HintsTest,
                  public testing::WithParamInterface<std::tuple<WaitMode, int>> {};
INSTANTIATE_TEST_SUITE_P(FewAndManyLinks, LostHints,
                         testing::Combine(kWaitModes, testing::Values(1, 100)));

TEST_P(LostHints, LostBeforeAWaitLoseNoMessage) {
  const auto [mode, links] = GetParam();
  End server(backplane_, "server", mode);
  End client(backplane_, "");
  for (int i = 1; i < links; ++i) connect(client, server);
  const auto link = connect(client, server);

  for (std::uint32_t id = 0; id < 3; ++id) {
    coolDown(server);
    ASSERT_EQ(send(link.client, id), LinkSend::sent);
    loseHints(server);
    ASSERT_EQ(take(server), id);
  }
}

TEST_P(LostHints, LostDuringAWaitLoseNoMessage) {
  const auto [mode, links] = GetParam();
  End server(backplane_, "server", mode);
  End client(backplane_, "");
  for (int i = 1; i < links; ++i) connect(client, server);
  const auto link = connect(client, server);
  link.client.setPeerIndex(kUnusedBit);  // rings the bell, but sets the bit of another link
  coolDown(server);
  std::atomic<std::uint32_t> taken{0};

  std::thread sender([&] {
    for (std::uint32_t id = 0; id < 3; ++id) {
      EXPECT_EQ(send(link.client, id), LinkSend::sent);
      while (taken != id + 1) std::this_thread::yield();
    }
  });
  for (std::uint32_t id = 0; id < 3; ++id) {
    EXPECT_EQ(take(server), id);
    ++taken;
  }
  sender.join();
}

TEST_F(HintsTest, AFloodDoesNotHideAMessageWithoutAHint) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto flood = connect(client, server);
  const auto quiet = connect(client, server);
  quiet.client.setPeerIndex(kUnusedBit);
  coolDown(server);
  ASSERT_EQ(send(quiet.client, 7), LinkSend::sent);

  for (bool found = false; !found;) {
    static_cast<void>(send(flood.client, 1));
    auto* const ready = server.endpoint.next();
    found = ready != nullptr && End::tryTake(*ready) == 7u;
  }
}

TEST_F(HintsTest, AnEventLoopIsNotifiedOfAMessageWithoutAHint) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto link = connect(client, server);
  coolDown(server);
  ASSERT_EQ(send(link.client, 7), LinkSend::sent);
  loseHints(server);

  EXPECT_FALSE(server.endpoint.arm());

  ASSERT_EQ(server.endpoint.next(), &link.server);
  EXPECT_EQ(End::tryTake(link.server), 7u);
}

TEST_F(HintsTest, HintsWithoutAMessageDoNoHarm) {
  End server(backplane_, "server");
  End client(backplane_, "");
  const auto first = connect(client, server);
  const auto second = connect(client, server);
  ASSERT_EQ(send(first.client, 1), LinkSend::sent);
  ASSERT_EQ(send(second.client, 2), LinkSend::sent);

  inventHints(server);
  std::uint32_t sum = 0;
  std::uint32_t knocks = 0;
  for (std::uint32_t looks = 0; looks < 2 * layout::kMaxLinks; ++looks) {
    if (auto* const ready = server.endpoint.next()) sum += End::tryTake(*ready).value_or(0);
  }
  while (server.endpoint.knocks().tryTake()) ++knocks;

  EXPECT_EQ(sum, 3u);
  EXPECT_EQ(knocks, layout::kKnocks);
  EXPECT_TRUE(server.endpoint.knocks().takeRescan());
  EXPECT_FALSE(server.endpoint.hasControlEvents());
  EXPECT_FALSE(server.endpoint.wait(Deadline::after(1ms))) << "no event is left";
}

TEST_F(HintsTest, APeerThatOverwritesHintsStopsNoOtherPeer) {
  constexpr std::uint32_t kTurns = 1000;
  End server(backplane_, "server", WaitMode::block);
  End client(backplane_, "", WaitMode::block);
  const auto link = connect(client, server);
  Random random;
  std::atomic<bool> end{false};
  std::thread scribbler([&] {
    auto& hints = server.endpoint.window().hints();
    while (!end) {
      hints.bell.store(static_cast<std::uint32_t>(random.bits()), std::memory_order_relaxed);
      hints.knocked.store(static_cast<std::uint32_t>(random.bits()), std::memory_order_relaxed);
      hints.rescan.store(static_cast<std::uint32_t>(random.bits()), std::memory_order_relaxed);
      hints.knocks[random.below(layout::kKnocks)].store(random.nasty(), std::memory_order_relaxed);
      hints.readyWords[random.below(hints.readyWords.size())].store(random.nasty(),
                                                                    std::memory_order_relaxed);
      hints.readyBits[random.below(hints.readyBits.size())].store(random.nasty(),
                                                                  std::memory_order_relaxed);
      std::this_thread::yield();
    }
  });
  std::thread echo([&] {
    for (std::uint32_t turn = 0; turn < kTurns; ++turn)
      EXPECT_EQ(send(link.server, take(server)), LinkSend::sent);
  });

  for (std::uint32_t turn = 0; turn < kTurns; ++turn) {
    EXPECT_EQ(send(link.client, turn), LinkSend::sent);
    ASSERT_EQ(take(client), turn);
  }

  echo.join();
  end = true;
  scribbler.join();
}

}  // namespace
}  // namespace mpf::test
