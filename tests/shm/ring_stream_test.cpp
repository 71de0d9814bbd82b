// SPDX-License-Identifier: MIT
// Ring: a stream of messages. The producer claims lines, the consumer keeps a distance.
#include <thread>
#include <utility>

#include "shm/cache_line.h"
#include "tests/shm/pinned.h"
#include "tests/shm/ring_fixture.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

TEST_F(RingTest, TheLastSlotsAreFreedWhenTheRingIsFoundEmpty) {
  ASSERT_TRUE(push(1));
  take();
  EXPECT_EQ(control_.freed.load(std::memory_order_relaxed), 0u) << "less than a batch";

  consumer_.onEmpty();

  EXPECT_EQ(control_.freed.load(std::memory_order_relaxed), 1u);
}

TEST_F(RingTest, CountsHowOftenItsOwnerWasIdleAfterMessages) {
  consumer_.onEmpty();
  EXPECT_EQ(consumer_.timesIdle(), 0u) << "without a message before";
  for (const auto ordinal : {1u, 2u}) ASSERT_TRUE(push(ordinal));
  for (int i = 0; i < 2; ++i) take();

  consumer_.onEmpty();
  consumer_.onEmpty();

  EXPECT_EQ(consumer_.timesIdle(), 1u);
}

constexpr std::uint16_t kType = 7;

bool tryPushTyped(RingProducer& producer) {
  return producer.tryPushShort([] { return Envelope{.type = kType}; }, 0, {}, 0);
}

TEST_F(RingTest, AClaimOfLinesKeepsTheMessagesThatWait) {
  for (std::uint32_t i = 0; i < kCapacity; ++i) ASSERT_TRUE(tryPushTyped(producer_));
  for (int i = 0; i < 2; ++i) take();

  // The first one claims both lines.
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(tryPushTyped(producer_));

  for (std::uint32_t i = 0; i < kCapacity; ++i) {
    ASSERT_TRUE(consumer_.hasMessage());
    EXPECT_EQ(consumer_.begin().type, kType);
    consumer_.end();
  }
}

TEST_F(RingTest, AClaimOfTheNextLineOfAFullRingKeepsTheMessageThere) {
  for (std::uint32_t i = 0; i < kCapacity; ++i) ASSERT_TRUE(tryPushTyped(producer_));

  producer_.claimNext();

  ASSERT_TRUE(consumer_.hasMessage());
  EXPECT_EQ(consumer_.begin().type, kType);
}

TEST_F(RingTest, KnowsWhetherTheOwnerWasIdleBeforeTheMessage) {
  for (const auto ordinal : {1u, 2u}) ASSERT_TRUE(push(ordinal));
  consumer_.onEmpty();

  take();
  EXPECT_TRUE(consumer_.wasIdle());
  take();
  EXPECT_FALSE(consumer_.wasIdle());
  consumer_.onEmpty();
  ASSERT_TRUE(push(3));
  take();
  EXPECT_TRUE(consumer_.wasIdle());
}

TEST_F(RingTest, TheProducerLooksWhereItsConsumerPolls) {
  const Pinned pinned;
  const auto here = lines::thisProcessor();
  for (const auto& [polledOn, isElsewhere] :
       {std::pair(0u, false), {here, false}, {here + 1, true}}) {
    const layout::Word32 word{polledOn};
    RingProducer producer(ring_, kCapacity, control_, {}, nullptr, &word);

    ASSERT_TRUE(producer.tryPushShort([] { return Envelope{}; }, 0, {}, 0));

    EXPECT_EQ(producer.isPolledElsewhere(), isElsewhere) << polledOn << ", we on " << here;
  }
}

TEST_F(RingTest, AConsumerThatPollsFollowsItsThreadToAnotherProcessor) {
  const Pinned pinned;
  const auto here = lines::thisProcessor();
  for (const auto& [before, after] : {std::pair(0u, 0u), {here + 1, here}}) {
    layout::Word32 word{before};
    RingConsumer consumer(ring_, kCapacity, control_, {}, &word);

    for (std::uint32_t i = 0; i < kCapacity; ++i) {
      static_cast<void>(consumer.begin());
      consumer.end();
    }

    EXPECT_EQ(word.load(std::memory_order_relaxed), after);
  }
}

// A ring that is long enough for the consumer to wait for the producer.
TEST(RingStream, IsDeliveredInOrder) {
  constexpr std::uint32_t kCapacity = 1024;
  constexpr std::uint32_t kMessages = 300'000;
  const Watchdog watchdog("a stream between two threads");
  const auto slots = std::make_unique<layout::Slot[]>(kCapacity);
  layout::RingControl control{};
  RingProducer producer(slots.get(), kCapacity, control);
  RingConsumer consumer(slots.get(), kCapacity, control);

  std::thread sender([&] {
    for (std::uint32_t i = 0; i < kMessages; ++i) {
      const auto envelope = [&] { return Envelope{.requestId = i}; };
      while (!producer.tryPushShort(envelope, sizeof i, std::as_bytes(std::span(&i, 1)), 0))
        std::this_thread::yield();
    }
  });
  std::uint32_t wrong = 0;
  for (std::uint32_t i = 0; i < kMessages; ++i) {
    while (!consumer.hasMessage()) {
      consumer.onEmpty();
      std::this_thread::yield();
    }
    const auto envelope = consumer.begin();
    std::uint32_t body = 0;
    consumer.copyBody(std::as_writable_bytes(std::span(&body, 1)));
    consumer.end();
    if (envelope.requestId != i || body != i) ++wrong;
  }
  sender.join();

  EXPECT_EQ(wrong, 0u);
  EXPECT_FALSE(consumer.hasMessage());
}

}  // namespace
}  // namespace mpf::test
