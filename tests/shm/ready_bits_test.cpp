// SPDX-License-Identifier: MIT
// ReadyBits: takes set bits in turn, and takes no harm from bits that peers set without reason.
#include "shm/ready_bits.h"

#include <array>
#include <atomic>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class ReadyBitsTest : public testing::Test {
 protected:
  std::optional<std::uint32_t> take() {
    return bits_.tryTake([](std::uint32_t) { return true; });
  }

  std::unique_ptr<layout::WindowHints> hints_ = std::make_unique<layout::WindowHints>();
  ReadyBits bits_{*hints_};
};

TEST_F(ReadyBitsTest, TakesEachBitOnce) {
  EXPECT_FALSE(bits_.hasAny());
  bits_.set(7);
  bits_.set(7);
  EXPECT_TRUE(bits_.hasAny());

  EXPECT_EQ(take(), 7u);

  EXPECT_FALSE(bits_.hasAny());
  EXPECT_FALSE(take());
}

TEST_F(ReadyBitsTest, ReachesEveryIndex) {
  for (std::uint32_t index = 0; index < layout::kMaxLinks; ++index) {
    bits_.set(index);
    ASSERT_EQ(take(), index);
  }
  EXPECT_FALSE(bits_.hasAny());
}

TEST_F(ReadyBitsTest, LowIndicesDoNotStarveHighOnes) {
  for (const std::uint32_t index : {3u, 5u, 70u, 16'000u}) bits_.set(index);

  for (const std::uint32_t index : {3u, 5u, 70u, 16'000u, 3u, 5u}) {
    EXPECT_EQ(take(), index);
    bits_.set(index);
  }
}

TEST_F(ReadyBitsTest, PassesBitsThatBelongToNoLink) {
  for (std::uint32_t index = 0; index < layout::kMaxLinks; ++index) bits_.set(index);
  const auto isLink = [](std::uint32_t index) { return index == 100; };

  std::optional<std::uint32_t> found;
  for (int calls = 0; calls < 64 && !found; ++calls) found = bits_.tryTake(isLink);

  EXPECT_EQ(found, 100u);
}

TEST_F(ReadyBitsTest, AWordWithoutBitsIsPassedOnce) {
  for (auto& word : hints_->readyWords) word.store(UINT64_MAX, std::memory_order_relaxed);

  EXPECT_FALSE(take());

  EXPECT_FALSE(bits_.hasAny());
}

// The bits of one word are set by several peers while the owner clears them.
TEST_F(ReadyBitsTest, NoBitIsLostBetweenPeersAndOwner) {
  constexpr std::uint32_t kPeers = 3;
  constexpr std::uint32_t kTurns = 20'000;
  const Watchdog watchdog("NoBitIsLostBetweenPeersAndOwner");
  std::array<std::atomic<std::uint32_t>, kPeers> taken{};
  std::vector<std::thread> peers;
  for (std::uint32_t peer = 0; peer < kPeers; ++peer) {
    peers.emplace_back([&, peer] {
      for (std::uint32_t turn = 1; turn <= kTurns; ++turn) {
        bits_.set(peer);
        while (taken[peer] < turn) std::this_thread::yield();
      }
    });
  }

  for (std::uint32_t left = kPeers * kTurns; left != 0;) {
    if (const auto index = take()) {
      ++taken[*index];
      --left;
    } else {
      std::this_thread::yield();
    }
  }

  for (auto& peer : peers) peer.join();
  EXPECT_FALSE(bits_.hasAny());
}

}  // namespace
}  // namespace mpf::test
