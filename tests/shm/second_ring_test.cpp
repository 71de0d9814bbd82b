// SPDX-License-Identifier: MIT
// A ring that continues in a second one when the first one is full and the consumer has given the
// second one memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <span>
#include <thread>
#include <vector>

#include "shm/ring.h"
#include "tests/shm/ring_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

constexpr std::uint32_t kFirst = 16;
constexpr std::uint32_t kSecond = 64;

// Both ends of a direction that has a second ring.
struct Pair {
  bool push(std::uint64_t ordinal, std::size_t bodyBytes = 8) {
    const Envelope envelope{.bodyBytes = static_cast<std::uint32_t>(bodyBytes),
                            .requestId = static_cast<std::uint32_t>(ordinal)};
    return producer.tryPush(envelope, pattern(ordinal, bodyBytes));
  }
  // Pushes messages of one slot until there is no room; returns their number.
  std::uint64_t fill(std::uint64_t ordinal) {
    const auto from = ordinal;
    while (push(ordinal)) ++ordinal;
    return ordinal - from;
  }
  void takeAndExpect(std::uint64_t ordinal) {
    ASSERT_TRUE(consumer.hasMessage()) << ordinal;
    const auto envelope = consumer.begin();
    Bytes body(std::min<std::size_t>(envelope.bodyBytes, consumer.inlineCapacity()));
    consumer.copyBody(body);
    consumer.end();
    ASSERT_EQ(envelope.requestId, ordinal);
    ASSERT_EQ(body, pattern(ordinal, body.size()));
  }
  void giveMemory() {
    // PAIR(second-ring): the memory is there before the producer uses it.
    hasMemory.store(1, std::memory_order_release);
  }

  std::vector<layout::Slot> slots = std::vector<layout::Slot>(kFirst + kSecond);
  layout::RingControl control{};
  layout::Word32 hasMemory{0};
  layout::Word64 moved{0};
  SecondRing second{slots.data() + kFirst, kSecond, &hasMemory, &moved};
  RingProducer producer{slots.data(), kFirst, control, second};
  RingConsumer consumer{slots.data(), kFirst, control, second};
};

class SecondRingTest : public testing::Test {
 protected:
  Pair pair_;
};

TEST_F(SecondRingTest, IsNotTouchedUntilItHasMemory) {
  EXPECT_EQ(pair_.fill(0), kFirst - 1) << "one slot is for the word that says where it continues";

  for (std::uint64_t ordinal = 0; ordinal < kFirst - 1; ++ordinal) pair_.takeAndExpect(ordinal);

  EXPECT_FALSE(pair_.consumer.hasMessage());
  EXPECT_EQ(pair_.moved.load(), 0u);
  for (const auto& slot : std::span(pair_.slots).last(kSecond)) EXPECT_EQ(slot.sequence.load(), 0u);
}

TEST_F(SecondRingTest, IsNotUsedWhileTheFirstHasRoom) {
  pair_.giveMemory();

  for (std::uint64_t ordinal = 0; ordinal < 1000; ++ordinal) {
    ASSERT_TRUE(pair_.push(ordinal));
    pair_.takeAndExpect(ordinal);
  }

  EXPECT_EQ(pair_.moved.load(), 0u);
}

// All slots of the second ring are free although the consumer has freed none of the first one.
TEST_F(SecondRingTest, HasRoomForItsOwnMessagesBesideThoseOfTheFirst) {
  const auto before = pair_.fill(0);
  pair_.giveMemory();

  const auto more = pair_.fill(before);

  EXPECT_EQ(more, kSecond);
  EXPECT_EQ(pair_.moved.load(), before + 1);
  for (std::uint64_t ordinal = 0; ordinal < before + more; ++ordinal) pair_.takeAndExpect(ordinal);
  EXPECT_FALSE(pair_.consumer.hasMessage());
  pair_.consumer.onEmpty();
  EXPECT_EQ(pair_.fill(before + more), kSecond) << "all slots are free again";
}

// Random numbers of messages of random lengths, and memory at a random time.
TEST_F(SecondRingTest, KeepsTheOrderAndTheBodiesWhereverItBegins) {
  Random random;
  for (int round = 0; round < 500; ++round) {
    Pair pair;
    const auto memoryAt = random.below(100);
    std::uint64_t pushed = 0;
    std::uint64_t taken = 0;
    for (std::uint64_t step = 0; step < 300; ++step) {
      if (step == memoryAt) pair.giveMemory();
      if (random.oneIn(2)) {
        if (pair.push(pushed, random.below(layout::kInlineBodyBytes + 1))) ++pushed;
      } else if (taken != pushed) {
        pair.takeAndExpect(taken++);
      } else {
        ASSERT_FALSE(pair.consumer.hasMessage());
      }
    }
    while (taken != pushed) pair.takeAndExpect(taken++);
    ASSERT_FALSE(pair.consumer.hasMessage());
  }
}

// Another thread takes, and gives the second ring memory at some time.
TEST_F(SecondRingTest, HandsEachMessageOverOnceWhileBothSidesRun) {
  Random random;
  for (int round = 0; round < 100; ++round) {
    constexpr std::uint64_t kMessages = 400;
    Pair pair;
    const auto memoryAt = random.below(kMessages / 2);
    std::thread taker([&] {
      for (std::uint64_t ordinal = 0; ordinal < kMessages; ++ordinal) {
        if (ordinal == memoryAt) pair.giveMemory();
        while (!pair.consumer.hasMessage()) std::this_thread::yield();
        pair.takeAndExpect(ordinal);
      }
    });
    for (std::uint64_t ordinal = 0; ordinal < kMessages; ++ordinal) {
      while (!pair.push(ordinal, ordinal % layout::kInlineBodyBytes)) std::this_thread::yield();
    }
    taker.join();
    ASSERT_FALSE(pair.consumer.hasMessage());
  }
}

// The word that a hostile producer writes leads the consumer nowhere without its own consent.
TEST_F(SecondRingTest, AProducerThatContinuesThereUnaskedIsNotFollowed) {
  pair_.slots[0].sequence.store(layout::kContinuesInSecondRing | 1, std::memory_order_relaxed);
  pair_.slots[kFirst].sequence.store(1, std::memory_order_relaxed);

  EXPECT_FALSE(pair_.consumer.hasMessage());

  pair_.giveMemory();
  EXPECT_TRUE(pair_.consumer.hasMessage());
}

// Words of a wrong position are no messages.
TEST_F(SecondRingTest, AWordOfAnotherPositionIsIgnored) {
  pair_.giveMemory();
  for (const std::uint64_t position : {1ull, 2ull, 16ull, ~0ull >> 1}) {
    pair_.slots[0].sequence.store(layout::kContinuesInSecondRing | (position + 1),
                                  std::memory_order_relaxed);
    EXPECT_FALSE(pair_.consumer.hasMessage()) << position;
  }
}

}  // namespace
}  // namespace mpf::test
