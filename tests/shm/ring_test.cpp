// SPDX-License-Identifier: MIT
// Ring: slots from one producer to one consumer.
#include <deque>
#include <thread>

#include "tests/shm/ring_fixture.h"
#include "tests/support/random.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

TEST_F(RingTest, AnEmptyRingHasNoMessage) { EXPECT_FALSE(consumer_.hasMessage()); }

TEST_F(RingTest, DeliversMessagesInOrderWithTheirEnvelopes) {
  const Envelope sent{.type = 1,
                      .flags = 2,
                      .bodyBytes = 3,
                      .requestId = 4,
                      .clientType = -5,
                      .clientExtra = -6,
                      .sentTick = 7,
                      .timeNs = 8};

  ASSERT_TRUE(producer_.tryPush(sent, pattern(1, 3)));
  ASSERT_TRUE(push(2));

  ASSERT_TRUE(consumer_.hasMessage());
  const auto got = consumer_.begin();
  EXPECT_EQ(got.type, 1);
  EXPECT_EQ(got.flags, 2);
  EXPECT_EQ(got.bodyBytes, 3u);
  EXPECT_EQ(got.requestId, 4u);
  EXPECT_EQ(got.clientType, -5);
  EXPECT_EQ(got.clientExtra, -6);
  EXPECT_EQ(got.sentTick, 7u);
  EXPECT_EQ(got.timeNs, 8);
  Bytes body(3);
  consumer_.copyBody(body);
  EXPECT_EQ(body, pattern(1, 3));
  consumer_.end();
  ASSERT_TRUE(consumer_.hasMessage());
  EXPECT_EQ(take(), pattern(2, 8));
  EXPECT_FALSE(consumer_.hasMessage());
}

TEST_F(RingTest, RefusesAMessageWhenFullAndKeepsTheOthers) {
  for (std::uint32_t i = 0; i < kCapacity; ++i) ASSERT_TRUE(push(i));

  EXPECT_FALSE(push(99));

  for (std::uint32_t i = 0; i < kCapacity; ++i) {
    ASSERT_TRUE(consumer_.hasMessage());
    EXPECT_EQ(take(), pattern(i, 8));
  }
  EXPECT_FALSE(consumer_.hasMessage());
  EXPECT_TRUE(push(100));
  EXPECT_EQ(take(), pattern(100, 8));
}

TEST_F(RingTest, RefusesAMessageThatNeedsMoreSlotsThanAreFree) {
  for (std::uint32_t i = 0; i < kCapacity - 3; ++i) ASSERT_TRUE(push(i));

  EXPECT_FALSE(push(99, layout::kInlineBodyBytes));

  EXPECT_TRUE(producer_.hasFree(3));
  EXPECT_FALSE(producer_.hasFree(4));
  EXPECT_EQ(producer_.messages(), kCapacity - 3);
  EXPECT_TRUE(push(50, layout::kInlineBodyBytes - 56));
  for (std::uint32_t i = 0; i < kCapacity - 3; ++i) EXPECT_EQ(take(), pattern(i, 8));
  EXPECT_EQ(take(), pattern(50, layout::kInlineBodyBytes - 56));
}

TEST_F(RingTest, KeepsTheReservedSlotsFree) {
  for (std::uint32_t i = 0; i < kCapacity - 2; ++i) ASSERT_TRUE(producer_.tryPush({}, {}, 2));

  EXPECT_FALSE(producer_.tryPush({}, {}, 2));
  EXPECT_FALSE(producer_.tryPush({}, {}, UINT32_MAX - 4));
  EXPECT_TRUE(producer_.tryPush({}, {}, 1));
}

class InlineSizes : public RingTest, public testing::WithParamInterface<std::size_t> {};

TEST_P(InlineSizes, AreDeliveredWholeAtEveryPositionOfTheRing) {
  for (std::uint64_t i = 0; i < 3 * kCapacity; ++i) {
    ASSERT_TRUE(push(i, GetParam()));
    ASSERT_TRUE(consumer_.hasMessage());
    ASSERT_EQ(take(), pattern(i, GetParam()));
  }
  EXPECT_FALSE(consumer_.hasMessage());
}
INSTANTIATE_TEST_SUITE_P(AroundEachSlotsEnd, InlineSizes,
                         testing::Values(0, 1, 23, 24, 25, 79, 80, 81, 135, 136, 137, 191, 192));

TEST(RingSlots, MatchTheSizeOfTheBody) {
  EXPECT_EQ(slotsFor(0), 1u);
  EXPECT_EQ(slotsFor(24), 1u);
  EXPECT_EQ(slotsFor(25), 2u);
  EXPECT_EQ(slotsFor(80), 2u);
  EXPECT_EQ(slotsFor(81), 3u);
  EXPECT_EQ(slotsFor(136), 3u);
  EXPECT_EQ(slotsFor(137), 4u);
  EXPECT_EQ(slotsFor(layout::kInlineBodyBytes), layout::kMaxMessageSlots);
  EXPECT_GT(slotsFor(layout::kInlineBodyBytes + 1), layout::kMaxMessageSlots);
}

// The consumer frees slots in batches, so the ring must be larger than the queue by one batch.
TEST(RingSlots, AlwaysHaveRoomForTheWholeQueue) {
  for (std::uint32_t queue = 1; queue <= 16384; queue += 1 + queue / 7) {
    const auto capacity = ringSlotsFor(queue);

    ASSERT_TRUE(std::has_single_bit(capacity)) << queue;
    ASSERT_LE(capacity, layout::kMaxRingSlots) << queue;
    ASSERT_GE(capacity, queue + capacity / kFreeFraction) << queue;
  }
}

TEST_F(RingTest, TheSenderSeesHowManyMessagesWaitAndAreTaken) {
  ASSERT_TRUE(push(1));
  ASSERT_TRUE(push(2, 100));
  EXPECT_EQ(producer_.waiting(), 2u);
  EXPECT_FALSE(producer_.isTaken(1));

  static_cast<void>(consumer_.begin());

  EXPECT_EQ(producer_.waitingAtMost(), 2u) << "the last value that was read";
  EXPECT_TRUE(producer_.isTaken(1)) << "counted before the consumer looks at it";
  EXPECT_FALSE(producer_.isTaken(2));
  EXPECT_EQ(producer_.waiting(), 1u);
  consumer_.end();
  take();
  EXPECT_TRUE(producer_.isTaken(2));
  EXPECT_FALSE(producer_.isTaken(3)) << "not sent yet";
  EXPECT_EQ(producer_.waiting(), 0u);
}

TEST_F(RingTest, AMessageWithoutItsSequenceIsNotVisible) {
  ASSERT_TRUE(push(1));
  take();
  auto& slot = ring_[1];
  slot.type = 7;
  slot.slots = 1;
  slot.bodyBytes = 8;

  EXPECT_FALSE(consumer_.hasMessage());
  ASSERT_TRUE(push(2)) << "the producer overwrites it";
  EXPECT_EQ(take(), pattern(2, 8));
}

// The first slot makes a message visible, and is written last.
TEST_F(RingTest, ALongMessageWithoutItsFirstSequenceIsNotVisible) {
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(push(1));
    take();
  }
  const auto before = ring_[2].sequence.load(std::memory_order_relaxed);
  ASSERT_TRUE(push(3, layout::kInlineBodyBytes));
  ring_[2].sequence.store(before, std::memory_order_relaxed);

  EXPECT_FALSE(consumer_.hasMessage());
}

// Slots after the first contain body bytes where first slots contain envelopes. In this test, these
// bytes are the sequence that the consumer waits for one lap later.
TEST_F(RingTest, BodyBytesOfAnEarlierLapAreNotReadAsAMessage) {
  constexpr std::uint32_t kSlots = 3;
  Bytes body(layout::kFirstSlotBodyBytes + (kSlots - 1) * sizeof(layout::MoreSlot::body));
  for (std::uint64_t position = 0; position < 16 * kCapacity; position += kSlots) {
    for (std::uint64_t at = 0; at + 8 <= body.size(); at += 8) {
      const auto slot = at < layout::kFirstSlotBodyBytes ? 0
                                                         : 1 + (at - layout::kFirstSlotBodyBytes) /
                                                                   sizeof(layout::MoreSlot::body);
      const std::uint64_t awaited = position + slot + kCapacity + 1;
      std::memcpy(body.data() + at, &awaited, sizeof awaited);
    }
    ASSERT_TRUE(producer_.tryPush({.bodyBytes = static_cast<std::uint32_t>(body.size())}, body));
    ASSERT_EQ(take(), body);
    ASSERT_FALSE(consumer_.hasMessage()) << position;
  }
}

TEST_F(RingTest, BehavesAsAQueueForEveryOrderOfPushesAndTakes) {
  Random random;
  std::deque<Bytes> model;
  std::uint64_t ordinal = 0;

  for (int step = 0; step < 200'000; ++step) {
    if (random.oneIn(2)) {
      const auto size = random.oneIn(3) ? random.below(layout::kInlineBodyBytes + 1) : 8;
      const bool fits = producer_.hasFree(slotsFor(size));
      ASSERT_EQ(push(ordinal, size), fits);
      if (fits) model.push_back(pattern(ordinal++, size));
    } else {
      ASSERT_EQ(consumer_.hasMessage(), !model.empty());
      if (model.empty()) continue;
      ASSERT_EQ(take(), model.front());
      model.pop_front();
    }
    ASSERT_EQ(producer_.waiting(), model.size());
  }
  EXPECT_EQ(consumer_.messages() + model.size(), producer_.messages());
}

TEST_F(RingTest, DeliversMessagesWholeBetweenThreads) {
  constexpr std::uint64_t kMessages = 100'000;
  const Watchdog watchdog("a ring between two threads");
  const auto sizeOf = [](std::uint64_t ordinal) {
    return ordinal % 11 == 0 ? ordinal % (layout::kInlineBodyBytes + 1) : ordinal % 25;
  };

  std::thread sender([&] {
    for (std::uint64_t i = 0; i < kMessages; ++i) {
      while (!push(i, sizeOf(i))) std::this_thread::yield();
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < kMessages; ++i) {
    while (!consumer_.hasMessage()) std::this_thread::yield();
    if (take() != pattern(i, sizeOf(i))) ++wrong;
  }
  sender.join();

  EXPECT_EQ(wrong, 0u);
  EXPECT_FALSE(consumer_.hasMessage());
  EXPECT_TRUE(producer_.isTaken(kMessages));
}

TEST(Tick, SpansAMinuteAndIsNeverZero) {
  EXPECT_NE(Tick::of(0), 0u);
  const std::int64_t wrapsSoon = (std::int64_t{1} << 36) - 1000;
  for (const std::int64_t passed :
       {std::int64_t{0}, std::int64_t{160}, std::int64_t{5'000}, std::int64_t{60'000'000'000}}) {
    EXPECT_NEAR(static_cast<double>(Tick::nsSince(Tick::of(wrapsSoon), wrapsSoon + passed)),
                static_cast<double>(passed), 32);
  }
}

}  // namespace
}  // namespace mpf::test
