// SPDX-License-Identifier: MIT
// The last messages of a ring, from copies of its slots.
#include "tools/inspect/ring_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/ring.h"

namespace mpf::tools {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class RingViewTest : public testing::Test {
 protected:
  static constexpr std::uint32_t kSlots = 16;
  using Slots = std::vector<layout::Slot>;

  void push(std::uint32_t requestId, std::size_t bytes = 4) {
    const std::vector<std::byte> body(bytes, static_cast<std::byte>(requestId));
    Envelope envelope;
    envelope.requestId = requestId;
    envelope.bodyBytes = static_cast<std::uint32_t>(bytes);
    ASSERT_TRUE(producer_.tryPush(envelope, body));
  }
  void take() {
    ASSERT_TRUE(consumer_.hasMessage());
    static_cast<void>(consumer_.begin());
    consumer_.end();
  }
  [[nodiscard]] Slots copy() const {
    Slots copied(kSlots);
    std::memcpy(static_cast<void*>(copied.data()), static_cast<const void*>(slots_.data()),
                kSlots * sizeof(layout::Slot));
    return copied;
  }
  [[nodiscard]] RingWords words() const {
    return {control_.freed.load(), control_.taken.load(), producer_.messages()};
  }
  // The view of a ring in which no process writes any more.
  [[nodiscard]] RingView view() const {
    return RingView::of(slots_, words(), slots_, words().freed);
  }
  // Position and state of each message, as "17 waiting".
  [[nodiscard]] static std::vector<std::string> texts(const RingView& view) {
    std::vector<std::string> all;
    for (const auto& message : view.messages)
      all.push_back(std::to_string(message.first.front().requestId) + " " +
                    toString(message.state));
    return all;
  }

  Slots slots_ = Slots(kSlots);
  layout::RingControl control_{};
  RingProducer producer_{slots_.data(), kSlots, control_};
  RingConsumer consumer_{slots_.data(), kSlots, control_};
};

TEST_F(RingViewTest, AnEmptyRingHasNoMessage) {
  EXPECT_THAT(view().messages, IsEmpty());
  EXPECT_EQ(view().end, 0U);
  EXPECT_THAT(RingView::of({}, {}, {}, 0).messages, IsEmpty());
}

TEST_F(RingViewTest, AMessageIsWaitingThenTakenThenFreed) {
  for (std::uint32_t id = 1; id <= 6; ++id) push(id);
  take();
  take();  // an eighth of the ring: the consumer frees both
  take();

  EXPECT_THAT(texts(view()),
              ElementsAre("1 freed", "2 freed", "3 taken", "4 waiting", "5 waiting", "6 waiting"));
  EXPECT_EQ(view().end, 6U);
}

TEST_F(RingViewTest, JoinsABodyOfSeveralSlots) {
  push(7, 100);
  push(8);

  const auto seen = view();

  ASSERT_THAT(texts(seen), ElementsAre("7 waiting", "8 waiting"));
  const auto body = seen.messages.front().inlineBody();
  EXPECT_EQ(seen.messages.front().bytes.size(), 3 * sizeof(layout::Slot));
  EXPECT_EQ(std::vector(body.begin(), body.begin() + 100), std::vector(100, std::byte{7}));
}

// In every lap and with messages of every length, the view has the last messages in order, each
// complete.
TEST_F(RingViewTest, HasTheLastMessagesAfterManyLaps) {
  for (std::uint32_t id = 1; id <= 200; ++id) {
    push(id, id % 5 * 48);
    take();

    const auto seen = view();

    ASSERT_FALSE(seen.messages.empty());
    auto expected = id;
    for (auto message = seen.messages.rbegin(); message != seen.messages.rend();
         ++message, --expected) {
      ASSERT_EQ(message->first.front().requestId, expected) << "after " << id;
      const auto body = message->inlineBody();
      for (std::size_t i = 0; i < message->first.front().bodyBytes; ++i)
        ASSERT_EQ(body[i], static_cast<std::byte>(expected));
    }
    ASSERT_GE(seen.messages.size(), std::min(id, 4U));
  }
}

TEST_F(RingViewTest, ReportsAMessageThatWasBegunButNotPublished) {
  push(1);
  slots_[1].requestId = 2;  // its sender died before the release store

  EXPECT_THAT(texts(view()), ElementsAre("1 waiting", "2 unpublished"));
}

// When the second copy was made, the sender had reused slots: messages that it may have overwritten
// are left out.
TEST_F(RingViewTest, LeavesOutMessagesThatMayHaveBeenOverwritten) {
  for (std::uint32_t id = 1; id <= 14; ++id) {
    push(id);
    take();
  }
  const auto first = copy();
  const auto before = words();
  for (std::uint32_t id = 15; id <= 20; ++id) {
    push(id);
    take();
  }
  const auto second = copy();

  const auto seen = RingView::of(first, before, second, words().freed);

  // The sender is at position 20 and may write four slots: positions below 8 are lost.
  EXPECT_THAT(texts(seen),
              ElementsAre("9 freed", "10 freed", "11 freed", "12 freed", "13 freed", "14 freed"));
  EXPECT_EQ(seen.overwritten, 8U);
}

TEST_F(RingViewTest, IgnoresImpossibleSequences) {
  for (std::uint32_t id = 1; id <= 3; ++id) push(id);
  slots_[5].sequence.store(6 + 1000 * kSlots);
  slots_[6].sequence.store(UINT64_MAX);
  slots_[7].sequence.store(3);

  EXPECT_EQ(view().end, 3U);
  EXPECT_THAT(texts(view()), ElementsAre("1 waiting", "2 waiting", "3 waiting"));
}

TEST_F(RingViewTest, SurvivesImpossibleCounters) {
  push(1);
  for (const auto freed : {UINT64_MAX, UINT64_MAX - 3, std::uint64_t{1} << 62}) {
    const auto seen = RingView::of(slots_, {freed, UINT64_MAX, 0}, slots_, freed);
    EXPECT_THAT(seen.messages, IsEmpty());
  }
  slots_[0].slots = 255;
  EXPECT_THAT(texts(RingView::of(slots_, {0, 5, 0}, slots_, 0)), ElementsAre("1 taken"));
}

}  // namespace
}  // namespace mpf::tools
