// SPDX-License-Identifier: MIT
// RingFollower: reads every message of a ring or reports an overrun, and never returns a message
// that was not sent.
#include "tools/tap/ring_follower.h"

#include "tests/shm/ring_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

using tools::FollowFrom;
using tools::RingCopy;
using tools::RingFollower;
using Next = tools::RingFollower::Next;

class RingFollowerTest : public RingTest {
 protected:
  RingFollower follow(FollowFrom from = FollowFrom::newest) {
    return {{ring_, kCapacity}, {}, from};
  }
  void cross(std::uint64_t ordinal, std::size_t bodyBytes = 8) {
    ASSERT_TRUE(push(ordinal, bodyBytes));
    EXPECT_EQ(take(), pattern(ordinal, bodyBytes));
  }
  // Expects that the follower's next message is `ordinal`.
  static void expectNext(RingFollower& follower, std::uint64_t ordinal, std::size_t bodyBytes = 8) {
    RingCopy copy;
    ASSERT_EQ(follower.tryNext(copy), Next::message);
    EXPECT_EQ(copy.envelope.requestId, ordinal);
    EXPECT_EQ(Bytes(copy.body().begin(), copy.body().end()), pattern(ordinal, bodyBytes));
  }
  static void expectNothing(RingFollower& follower) {
    RingCopy copy;
    EXPECT_EQ(follower.tryNext(copy), Next::nothing);
  }
};

TEST_F(RingFollowerTest, ReadsMessagesOfEverySizeInOrder) {
  auto follower = follow();
  std::uint64_t ordinal = 0;
  for (std::size_t bytes = 0; bytes <= layout::kInlineBodyBytes; ++bytes) {
    cross(++ordinal, bytes);
    expectNext(follower, ordinal, bytes);
    expectNothing(follower);
  }
}

// A ring that continues in a second one.
class SecondRingFollowerTest : public testing::Test {
 protected:
  static constexpr std::uint32_t kFirst = 16;
  static constexpr std::uint32_t kSecond = 64;

  RingFollower follow(FollowFrom from) {
    const std::span<const layout::Slot> all(slots_);
    return {all.first(kFirst), all.last(kSecond), from};
  }
  void push(std::uint64_t ordinal) {
    ASSERT_TRUE(producer_.tryPush(
        {.bodyBytes = 8, .requestId = static_cast<std::uint32_t>(ordinal)}, pattern(ordinal, 8)));
  }
  // Fills the first ring and some slots of the second one.
  void pushIntoBoth() {
    for (; pushed_ < kFirst - 1; ++pushed_) push(pushed_);
    hasMemory_ = 1;
    for (; pushed_ < kFirst + 10; ++pushed_) push(pushed_);
    ASSERT_EQ(moved_, kFirst);
  }
  static void expectNext(RingFollower& follower, std::uint64_t ordinal) {
    RingCopy copy;
    ASSERT_EQ(follower.tryNext(copy), Next::message);
    EXPECT_EQ(copy.envelope.requestId, ordinal);
    EXPECT_EQ(Bytes(copy.body().begin(), copy.body().end()), pattern(ordinal, 8));
  }

  std::vector<layout::Slot> slots_{kFirst + kSecond};
  layout::RingControl control_{};
  layout::Word32 hasMemory_{0};
  layout::Word64 moved_{0};
  RingProducer producer_{
      slots_.data(), kFirst, control_, {slots_.data() + kFirst, kSecond, &hasMemory_, &moved_}};
  std::uint64_t pushed_ = 0;
};

TEST_F(SecondRingFollowerTest, FollowsTheProducerFromMessageToMessage) {
  auto follower = follow(FollowFrom::first);
  push(pushed_++);
  expectNext(follower, 0);

  pushIntoBoth();

  // The first ring was read too late: the producer is more than half of it ahead.
  RingCopy copy;
  EXPECT_EQ(follower.tryNext(copy), Next::overrun);
  for (auto ordinal = std::uint64_t{kFirst} - 1; ordinal < pushed_; ++ordinal)
    expectNext(follower, ordinal);
  EXPECT_EQ(follower.tryNext(copy), Next::nothing);
  push(pushed_);
  expectNext(follower, pushed_);
}

TEST_F(SecondRingFollowerTest, ReadsWhatTheFirstRingHoldsBeforeItMoves) {
  for (; pushed_ < kFirst - 2; ++pushed_) push(pushed_);
  auto follower = follow(FollowFrom::newest);
  push(pushed_++);
  hasMemory_ = 1;
  push(pushed_++);
  push(pushed_++);
  ASSERT_EQ(moved_, kFirst);

  for (const auto ordinal : {pushed_ - 3, pushed_ - 2, pushed_ - 1}) expectNext(follower, ordinal);
}

TEST_F(SecondRingFollowerTest, BeginsBehindTheNewestMessageOfTheSecondRing) {
  pushIntoBoth();

  auto follower = follow(FollowFrom::newest);

  RingCopy copy;
  EXPECT_EQ(follower.tryNext(copy), Next::nothing);
  push(pushed_);
  expectNext(follower, pushed_);
}

// A slot of the first ring says that the messages continue at a position that none can have. The
// follower reads on where the messages are.
TEST_F(SecondRingFollowerTest, IgnoresAMoveToAnImpossiblePosition) {
  constexpr auto kBeyondAll = (std::uint64_t{1} << 62) + kFirst;
  for (const auto sequence : {std::uint64_t{0}, kBeyondAll}) {
    slots_[kFirst - 1].sequence = layout::kContinuesInSecondRing | sequence;
    auto follower = follow(FollowFrom::newest);
    RingCopy copy;
    EXPECT_EQ(follower.tryNext(copy), Next::nothing);

    push(pushed_);

    expectNext(follower, pushed_++);
  }
}

TEST_F(RingFollowerTest, ReadsMessagesBeforeAndAfterTheyAreTaken) {
  auto follower = follow();
  ASSERT_TRUE(push(1));

  expectNext(follower, 1);
  EXPECT_EQ(take(), pattern(1, 8));
  cross(2);
  expectNext(follower, 2);
}

TEST_F(RingFollowerTest, BeginsBehindTheNewestMessageAtAnyPosition) {
  for (std::uint64_t ordinal = 1; ordinal < 100; ++ordinal) {
    cross(ordinal, ordinal % layout::kInlineBodyBytes);
    auto follower = follow();
    expectNothing(follower);
    cross(1000 + ordinal);
    expectNext(follower, 1000 + ordinal);
  }
}

TEST_F(RingFollowerTest, BeginsWithTheFirstMessageWhenAsked) {
  cross(1);
  cross(2, layout::kInlineBodyBytes);

  auto follower = follow(FollowFrom::first);

  expectNext(follower, 1);
  expectNext(follower, 2, layout::kInlineBodyBytes);
  expectNothing(follower);
}

TEST_F(RingFollowerTest, ContinuesAQuarterOfTheRingBackAfterAnOverrun) {
  auto follower = follow();
  for (std::uint64_t ordinal = 1; ordinal <= 3 * kCapacity; ++ordinal) cross(ordinal);

  RingCopy copy;
  EXPECT_EQ(follower.tryNext(copy), Next::overrun);
  for (auto ordinal = 3 * kCapacity - kCapacity / 4 + 1; ordinal <= 3 * kCapacity; ++ordinal)
    expectNext(follower, ordinal);
  expectNothing(follower);
  cross(1000);
  expectNext(follower, 1000);
}

TEST_F(RingFollowerTest, ContinuesAtABeginningOfAMessageAfterAnOverrun) {
  for (std::uint64_t count = kCapacity; count < kCapacity + 5; ++count) {
    auto follower = follow();
    for (std::uint64_t ordinal = 1; ordinal <= count; ++ordinal)
      cross(ordinal, layout::kInlineBodyBytes);

    RingCopy copy;
    EXPECT_EQ(follower.tryNext(copy), Next::overrun);
    const auto kept = kCapacity / 4 / layout::kMaxMessageSlots;
    for (auto ordinal = count - kept + 1; ordinal <= count; ++ordinal)
      expectNext(follower, ordinal, layout::kInlineBodyBytes);
    expectNothing(follower);
  }
}

// A message of several slots does not change the sequences of its later slots, so those keep old
// values.
TEST_F(RingFollowerTest, DetectsAnOverrunByLongMessages) {
  for (std::uint64_t warmUp = 0; warmUp < 7; ++warmUp) {
    cross(warmUp);
    auto follower = follow();
    for (std::uint64_t ordinal = 0; ordinal < kCapacity; ++ordinal)
      cross(ordinal, layout::kInlineBodyBytes);

    RingCopy copy;
    EXPECT_EQ(follower.tryNext(copy), Next::overrun);
  }
}

TEST_F(RingFollowerTest, SkipsInvalidData) {
  auto follower = follow();
  ASSERT_TRUE(push(1));
  ring_[0].slots = 99;

  RingCopy copy;
  EXPECT_EQ(follower.tryNext(copy), Next::overrun);
  EXPECT_NE(follower.tryNext(copy), Next::message);
}

// The producer may write any sequence into any slot. A sequence that does not fit its slot must not
// cause endless overruns.
TEST_F(RingFollowerTest, IgnoresASequenceThatDoesNotFitItsSlot) {
  auto follower = follow();
  for (const std::uint64_t sequence : {std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    for (std::uint64_t slot = 0; slot < kCapacity; ++slot)
      ring_[slot].sequence.store(sequence + slot * 2, std::memory_order_relaxed);

    RingCopy copy;
    if (follower.tryNext(copy) == Next::overrun) expectNothing(follower);
  }
}

// The newest message has the highest position, and the slot behind it contains invalid data, which
// must not cause endless overruns either.
TEST_F(RingFollowerTest, ReadsNothingBehindTheHighestPosition) {
  constexpr auto kHighest = (std::uint64_t{1} << 62) - 1;
  ring_[kHighest % kCapacity].sequence = kHighest + 1;
  ring_[(kHighest + 1) % kCapacity].sequence = kHighest + 2;

  auto follower = follow();

  expectNothing(follower);
}

TEST_F(RingFollowerTest, SurvivesRandomBytes) {
  Random random;
  RingCopy copy;
  for (int round = 0; round < 2000; ++round) {
    auto follower = follow(round % 2 == 0 ? FollowFrom::first : FollowFrom::newest);
    for (std::size_t i = 0; i < kCapacity * sizeof(layout::Slot); ++i)
      ringBytes()[i] = static_cast<std::byte>(random.bits());
    // Also writes sequences that fit their slots, which random bytes hardly ever do.
    for (std::uint32_t slot = 0; slot < kCapacity; ++slot)
      ring_[slot].sequence = slot + 1 + kCapacity * random.below(3);
    for (std::uint32_t i = 0; i < 2 * kCapacity; ++i) {
      if (follower.tryNext(copy) == Next::message) {
        EXPECT_LE(copy.size, layout::kInlineBodyBytes);
      }
    }
  }
}

// The follower returns each message, complete and in order, unless it reports an overrun.
TEST_F(RingFollowerTest, ReportsEveryMissedMessageInAnyOrderOfOperations) {
  Random random;
  auto follower = follow();
  std::uint64_t pushed = 0;
  std::uint64_t taken = 0;
  std::uint64_t next = 1;
  std::vector<std::size_t> sizes{0};
  std::uint64_t overruns = 0;
  bool isLater = false;  // after an overrun, a later message is the next one
  for (int step = 0; step < 200'000; ++step) {
    switch (random.below(3)) {
      case 0: {
        const auto size = random.below(layout::kInlineBodyBytes + 1);
        if (push(pushed + 1, size)) {
          ++pushed;
          sizes.push_back(size);
        }
        break;
      }
      case 1:
        if (consumer_.hasMessage()) {
          ++taken;
          EXPECT_EQ(take(), pattern(taken, sizes[taken]));
        }
        break;
      default: {
        if (!random.oneIn(4)) break;
        RingCopy copy;
        const auto what = follower.tryNext(copy);
        if (what == Next::nothing) {
          if (std::exchange(isLater, false)) next = pushed + 1;
          EXPECT_EQ(next, pushed + 1);
        }
        if (what == Next::overrun) {
          ++overruns;
          isLater = true;
        }
        if (what != Next::message) break;
        if (std::exchange(isLater, false)) {
          EXPECT_GT(copy.envelope.requestId, next);
          next = copy.envelope.requestId;
        }
        ASSERT_EQ(copy.envelope.requestId, next);
        ASSERT_EQ(Bytes(copy.body().begin(), copy.body().end()), pattern(next, sizes[next]));
        ++next;
      }
    }
  }
  EXPECT_GT(overruns, 0u);
  EXPECT_LT(overruns, pushed);
}

}  // namespace
}  // namespace mpf::test
