// SPDX-License-Identifier: MIT
// A ring in which the other end writes invalid data: this costs only messages of this ring.
#include "tests/shm/ring_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

class SlotCounts : public RingTest, public testing::WithParamInterface<int> {};

TEST_P(SlotCounts, OfInvalidValuesHaveNoBodyAndCountAsOneSlot) {
  ASSERT_TRUE(push(1));
  ASSERT_TRUE(push(2));
  ring_[0].slots = static_cast<std::uint8_t>(GetParam());
  ring_[0].bodyBytes = UINT32_MAX;

  const auto envelope = consumer_.begin();
  const auto capacity = consumer_.inlineCapacity();
  consumer_.end();

  EXPECT_EQ(envelope.bodyBytes, UINT32_MAX)
      << "the envelope is copied unchanged; the reader checks it";
  EXPECT_EQ(capacity, 0u);
  ASSERT_TRUE(consumer_.hasMessage());
  EXPECT_EQ(take(), pattern(2, 8));
}
INSTANTIATE_TEST_SUITE_P(Invalid, SlotCounts, testing::Values(0, 5, 127, 200, 255));

TEST_F(RingTest, ReadsTheSlotCountOnce) {
  ASSERT_TRUE(push(1));

  static_cast<void>(consumer_.begin());
  ring_[0].slots = 4;
  const auto capacity = consumer_.inlineCapacity();
  consumer_.end();

  EXPECT_EQ(capacity, layout::kFirstSlotBodyBytes);
  ASSERT_TRUE(push(2));
  EXPECT_TRUE(consumer_.hasMessage());
}

TEST_F(RingTest, IgnoresASequenceOfAnotherPosition) {
  for (const std::uint64_t sequence :
       {std::uint64_t{0}, std::uint64_t{2}, std::uint64_t{kCapacity + 1}, UINT64_MAX}) {
    ring_[0].sequence.store(sequence, std::memory_order_relaxed);
    EXPECT_FALSE(consumer_.hasMessage()) << sequence;
  }
}

TEST_F(RingTest, FreedSlotsThatWereNeverUsedAddNoRoom) {
  for (std::uint32_t i = 0; i < kCapacity; ++i) ASSERT_TRUE(push(i));

  control_.freed.store(UINT64_MAX, std::memory_order_relaxed);

  EXPECT_TRUE(producer_.hasFree(kCapacity));
  EXPECT_FALSE(producer_.hasFree(kCapacity + 1));
}

TEST_F(RingTest, AFreedPositionThatDecreasesRemovesNoRoom) {
  ASSERT_TRUE(push(1));
  take();
  consumer_.onEmpty();
  ASSERT_TRUE(producer_.hasFree(kCapacity));

  control_.freed.store(0, std::memory_order_relaxed);

  for (std::uint32_t i = 0; i < kCapacity; ++i) EXPECT_TRUE(push(i));
  EXPECT_FALSE(push(99));
}

TEST_F(RingTest, LimitsTheCountOfTakenMessagesToThoseSent) {
  ASSERT_TRUE(push(1));
  ASSERT_TRUE(push(2));

  control_.taken.store(UINT64_MAX, std::memory_order_relaxed);
  EXPECT_EQ(producer_.waiting(), 0u);
  EXPECT_FALSE(producer_.isTaken(3));
  control_.taken.store(0, std::memory_order_relaxed);
  EXPECT_EQ(producer_.waiting(), 0u) << "taken messages stay taken";
  EXPECT_TRUE(producer_.isTaken(2));
}

// Each step ends and stays inside the ring (the fixture checks the guard slots), for all data that
// the other side writes.
TEST_F(RingTest, InvalidDataAnywhereCrashesAndBlocksNoEnd) {
  Random random;
  Bytes body(layout::kInlineBodyBytes);
  constexpr auto kRingBytes = sizeof(layout::Slot) * kCapacity;
  std::uint64_t taken = 0;

  for (int step = 0; step < 300'000; ++step) {
    switch (random.below(6)) {
      case 0:
        ringBytes()[random.below(kRingBytes)] = static_cast<std::byte>(random.bits());
        break;
      case 1:  // values that are probably accepted: the sequences of the next positions
        ring_[random.below(kCapacity)].sequence.store(taken + random.below(2 * kCapacity),
                                                      std::memory_order_relaxed);
        break;
      case 2:
        control_.freed.store(random.nasty(), std::memory_order_relaxed);
        break;
      case 3:
        control_.taken.store(random.nasty(), std::memory_order_relaxed);
        break;
      case 4: {
        const auto before = producer_.messages();
        const bool pushed =
            push(static_cast<std::uint64_t>(step), random.below(layout::kInlineBodyBytes + 1));
        ASSERT_EQ(producer_.messages(), before + (pushed ? 1 : 0));
        ASSERT_LE(producer_.waiting(), producer_.messages());
        break;
      }
      default:
        if (!consumer_.hasMessage()) break;
        const auto envelope = consumer_.begin();
        ASSERT_LE(consumer_.inlineCapacity(), layout::kInlineBodyBytes);
        consumer_.copyBody(std::span(body).first(
            std::min<std::size_t>(envelope.bodyBytes, consumer_.inlineCapacity())));
        consumer_.end();
        ++taken;
    }
  }
  EXPECT_EQ(consumer_.messages(), taken);
}

}  // namespace
}  // namespace mpf::test
