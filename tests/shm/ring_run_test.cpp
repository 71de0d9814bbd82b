// SPDX-License-Identifier: MIT
// Ring: messages with the same envelope, which one end pushes, and the other takes, together.
#include <cstring>

#include "tests/shm/ring_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

class RingRunTest : public testing::Test {
 protected:
  static constexpr std::uint32_t kCapacity = 128;  // batches of 16
  static constexpr std::uint64_t kMost = 16;
  static constexpr Envelope kEnvelope{.type = 3,
                                      .bodyBytes = layout::kFirstSlotBodyBytes,
                                      .requestId = 4,
                                      .clientType = 5,
                                      .clientExtra = 6,
                                      .timeNs = 7};

  void push(std::uint64_t number, const Envelope& envelope = kEnvelope) {
    Bytes body(envelope.bodyBytes);
    std::memcpy(body.data(), &number, std::min(sizeof number, body.size()));
    ASSERT_TRUE(producer_.tryPush(envelope, body));
  }
  // Bodies that begin with numbers from `first` on, one after the other.
  static Bytes bodies(std::uint64_t first, std::size_t count) {
    Bytes all(count * layout::kFirstSlotBodyBytes);
    for (std::size_t i = 0; i < count; ++i) {
      const auto number = first + i;
      std::memcpy(all.data() + i * layout::kFirstSlotBodyBytes, &number, sizeof number);
    }
    return all;
  }
  // Pushes as many as fit; returns their number.
  std::size_t pushAll(std::uint64_t first, std::size_t count, std::uint32_t reserve = 0) {
    const auto all = bodies(first, count);
    std::size_t pushed = 0;
    for (;;) {
      const auto* const next = all.data() + pushed * layout::kFirstSlotBodyBytes;
      const auto more = producer_.pushRun([&](std::size_t) { return wordsOf(kEnvelope); }, next,
                                          count - pushed, reserve);
      counted_ += more;
      EXPECT_EQ(producer_.messages(), counted_);
      pushed += more;
      if (more == 0 || pushed == count) return pushed;
    }
  }
  static EnvelopeWords wordsOf(const Envelope& envelope) {
    return EnvelopeWords::of(envelope, 1, envelope.bodyBytes);
  }
  // Takes messages with kEnvelope, whatever their ticks, and returns their numbers.
  std::vector<std::uint64_t> takeRun(std::uint64_t most = kMost) {
    return takeRun(most, [](const EnvelopeWords& words) {
      const auto like = wordsOf(kEnvelope);
      return words.body == like.body && words.request == like.request && words.hasMarksOf(like);
    });
  }
  template <class Accept>
  std::vector<std::uint64_t> takeRun(std::uint64_t most, const Accept& accept) {
    std::vector<std::uint64_t> numbers;
    const auto count = consumer_.takeRun(most, accept, [&](auto taken, const auto& body) {
      for (std::uint64_t index = 0; index < taken; ++index) numbers.push_back(body(index).first);
    });
    EXPECT_EQ(count, numbers.size());
    return numbers;
  }

  std::unique_ptr<layout::Slot[]> slots_ = std::make_unique<layout::Slot[]>(kCapacity);
  layout::RingControl control_{};
  RingProducer producer_{slots_.get(), kCapacity, control_};
  RingConsumer consumer_{slots_.get(), kCapacity, control_};
  std::uint64_t counted_ = 0;  // as pushRun() has returned
};

TEST_F(RingRunTest, TakesWhatIsThereAndCountsIt) {
  for (const auto number : {10u, 11u, 12u}) push(number);

  EXPECT_THAT(takeRun(), ElementsAre(10, 11, 12));

  EXPECT_EQ(consumer_.messages(), 3u);
  EXPECT_EQ(control_.taken.load(std::memory_order_relaxed), 3u);
  EXPECT_FALSE(consumer_.hasMessage());
  push(13);
  EXPECT_TRUE(consumer_.hasMessage());
}

TEST_F(RingRunTest, TakesNothingFromAnEmptyRing) {
  EXPECT_THAT(takeRun(), ElementsAre());

  EXPECT_EQ(control_.taken.load(std::memory_order_relaxed), 0u);
}

TEST_F(RingRunTest, TakesNoMoreThanItIsAllowedTo) {
  for (const auto number : {10u, 11u, 12u, 13u}) push(number);

  EXPECT_THAT(takeRun(2), ElementsAre(10, 11));
  EXPECT_THAT(takeRun(0), ElementsAre());
}

TEST_F(RingRunTest, StopsAtTheEndOfABatchAndFreesIt) {
  for (std::uint64_t number = 0; number < 20; ++number) push(number);
  EXPECT_EQ(takeRun(1).size(), 1u);

  EXPECT_EQ(takeRun(100).size(), 15u);

  EXPECT_EQ(control_.freed.load(std::memory_order_relaxed), 16u);
}

TEST_F(RingRunTest, ShowsTheEnvelopeOfEachMessageBeforeItIsTaken) {
  auto other = kEnvelope;
  other.requestId = 99;
  other.sentTick = 98;
  push(10);
  push(11, other);
  push(12);
  std::vector<EnvelopeWords> seen;

  const auto numbers = takeRun(kMost, [&](const EnvelopeWords& words) {
    EXPECT_EQ(control_.taken.load(std::memory_order_relaxed), 0u);
    seen.push_back(words);
    return seen.size() < 3;
  });

  EXPECT_THAT(numbers, ElementsAre(10, 11));
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_EQ(seen[0].requestId(), kEnvelope.requestId);
  EXPECT_EQ(seen[0].sentTick(), 0u);
  EXPECT_EQ(seen[1].requestId(), 99u);
  EXPECT_EQ(seen[1].sentTick(), 98u);
  EXPECT_TRUE(seen[1].hasMarksOf(seen[0]));
}

TEST_F(RingRunTest, SeesWhetherASecondMessageFollows) {
  push(10);
  EXPECT_FALSE(consumer_.hasSecond());

  push(11);

  EXPECT_TRUE(consumer_.hasSecond());
  EXPECT_EQ(consumer_.nextType(), kEnvelope.type);
}

TEST_F(RingRunTest, TheTickMayDiffer) {
  auto timed = kEnvelope;
  timed.sentTick = 99;
  push(10);
  push(11, timed);
  push(12);

  EXPECT_THAT(takeRun(), ElementsAre(10, 11, 12));
}

TEST_F(RingRunTest, StopsAtAnyOtherEnvelope) {
  using Change = void (*)(Envelope&);
  for (const Change change : std::to_array<Change>({
           [](Envelope& envelope) { ++envelope.type; },
           [](Envelope& envelope) { envelope.flags = layout::kSlotFirstReply; },
           [](Envelope& envelope) { envelope.flags = layout::kSlotChunk; },
           [](Envelope& envelope) { --envelope.bodyBytes; },
           [](Envelope& envelope) { envelope.bodyBytes = layout::kFirstSlotBodyBytes + 1; },
           [](Envelope& envelope) { ++envelope.requestId; },
           [](Envelope& envelope) { ++envelope.clientType; },
           [](Envelope& envelope) { ++envelope.clientExtra; },
           [](Envelope& envelope) { ++envelope.timeNs; },
       })) {
    auto other = kEnvelope;
    change(other);
    push(10);
    push(11);
    push(12, other);

    EXPECT_THAT(takeRun(), ElementsAre(10, 11));

    ASSERT_TRUE(consumer_.hasMessage());
    EXPECT_EQ(consumer_.begin().bodyBytes, other.bodyBytes);
    consumer_.end();
    consumer_.onEmpty();
  }
}

TEST_F(RingRunTest, StopsAtAMessageOfSeveralSlotsAccordingToItsEnvelope) {
  for (const auto slots : std::to_array<std::uint8_t>({0, 2, 255})) {
    const auto at = consumer_.messages() + 1;
    push(10);
    push(11);
    slots_[at % kCapacity].slots = slots;

    EXPECT_THAT(takeRun(), ElementsAre(10)) << int{slots};

    ASSERT_TRUE(consumer_.hasMessage());
    slots_[at % kCapacity].slots = 1;
    EXPECT_THAT(takeRun(), ElementsAre(11));
  }
}

// A second, larger ring goes on where the first one is full.
TEST_F(RingRunTest, CrossesIntoASecondRing) {
  constexpr std::uint32_t kFirst = 16;
  constexpr std::uint64_t kMessages = 100;
  layout::Word32 hasMemory{1};
  layout::Word64 moved{0};
  const SecondRing second{slots_.get() + kFirst, 64, &hasMemory, &moved};
  RingProducer producer(slots_.get(), kFirst, control_, second);
  RingConsumer consumer(slots_.get(), kFirst, control_, second);
  const auto all = bodies(0, kMessages);

  std::uint64_t pushed = 0;
  std::vector<std::uint64_t> taken;
  while (taken.size() < kMessages) {
    for (std::uint64_t more = 1; more != 0 && pushed < kMessages; pushed += more) {
      more = producer.pushRun([](std::size_t) { return wordsOf(kEnvelope); },
                              all.data() + pushed * layout::kFirstSlotBodyBytes, kMessages - pushed,
                              2);
    }
    while (consumer.hasMessage()) {
      consumer.takeRun(
          kMost, [](const EnvelopeWords&) { return true; },
          [&](auto count, const auto& body) {
            for (std::uint64_t at = 0; at < count; ++at) taken.push_back(body(at).first);
          });
    }
    consumer.onEmpty();
  }

  EXPECT_NE(moved.load(std::memory_order_relaxed), 0u);
  for (std::uint64_t number = 0; number < kMessages; ++number) ASSERT_EQ(taken[number], number);
}

TEST_F(RingRunTest, PushesEachBodyWithTheEnvelope) {
  ASSERT_EQ(pushAll(10, 3), 3u);

  EXPECT_EQ(producer_.messages(), 3u);
  for (const auto number : {10u, 11u, 12u}) {
    ASSERT_TRUE(consumer_.hasMessage());
    const auto envelope = consumer_.begin();
    EXPECT_TRUE(consumer_.hasOneSlot());
    EXPECT_EQ(envelope.type, kEnvelope.type);
    EXPECT_EQ(envelope.flags, 0);
    EXPECT_EQ(envelope.bodyBytes, kEnvelope.bodyBytes);
    EXPECT_EQ(envelope.requestId, kEnvelope.requestId);
    EXPECT_EQ(envelope.clientType, kEnvelope.clientType);
    EXPECT_EQ(envelope.clientExtra, kEnvelope.clientExtra);
    EXPECT_EQ(envelope.timeNs, kEnvelope.timeNs);
    EXPECT_EQ(consumer_.firstBody().first, number);
    consumer_.end();
  }
  EXPECT_FALSE(consumer_.hasMessage());
}

TEST_F(RingRunTest, PushesEachMessageWithAnEnvelopeOfItsOwn) {
  const auto words = [](std::size_t index) {
    auto envelope = kEnvelope;
    envelope.requestId = static_cast<std::uint32_t>(index);
    return wordsOf(envelope);
  };

  ASSERT_EQ(producer_.pushRun(words, bodies(10, 3).data(), 3, 0), 3u);

  for (const auto id : {0u, 1u, 2u}) {
    EXPECT_EQ(consumer_.begin().requestId, id);
    consumer_.end();
  }
}

TEST_F(RingRunTest, KeepsTheReservedSlotsFree) {
  EXPECT_EQ(pushAll(0, 2 * kCapacity, 5), kCapacity - 5);
  EXPECT_EQ(pushAll(0, 1, 5), 0u) << "the ring is full but for the reserve";

  EXPECT_EQ(pushAll(0, 2 * kCapacity), 5u);
}

TEST_F(RingRunTest, PushesAndTakesBodiesAroundTheEndOfTheRing) {
  std::uint64_t pushed = 0;
  std::uint64_t expected = 0;
  for (int round = 0; round < 100; ++round) {
    ASSERT_EQ(pushAll(pushed, 41), 41u);
    pushed += 41;
    while (consumer_.hasMessage()) {
      for (const auto number : takeRun()) ASSERT_EQ(number, expected++);
    }
    consumer_.onEmpty();
    ASSERT_EQ(expected, pushed);
  }
}

}  // namespace
}  // namespace mpf::test
