// SPDX-License-Identifier: MIT
// Ring: hands messages of 1 to 4 slots from one producer process to one consumer process.
//
//   | slot 0 | slot 1 | ... | slot capacity-1 |
//
//   first slot of a message   sequence, envelope, 24 bytes of the body
//   further slots             56 bytes of the body each
//
// A ring may continue in a second, larger one. The consumer gives that one memory when it needs it;
// the producer moves there when the first ring is full, and never returns. Positions go on:
//
//   | first ring, full | ─ slot that says "continues" ─► | second ring |
//
// Threads  one thread pushes, one thread takes.
// Crash    a producer that is killed before its release store has pushed nothing. A consumer that
//          is killed after it counted a message as taken may or may not have acted on it.
// Trust    each end keeps its own positions. Values that the other side writes are range-checked;
//          wrong ones cost messages, never memory safety.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <utility>

#include <mpf/detail/copy_words.h>

#include "base/step.h"
#include "shm/cpu_relax.h"
#include "shm/envelope.h"
#include "shm/layout.h"

namespace mpf {

[[nodiscard]] constexpr std::uint32_t slotsFor(std::size_t inlineBytes) noexcept {
  if (inlineBytes <= layout::kFirstSlotBodyBytes) return 1;
  const auto more = inlineBytes - layout::kFirstSlotBodyBytes;
  return 1 + static_cast<std::uint32_t>((more + sizeof(layout::MoreSlot::body) - 1) /
                                        sizeof(layout::MoreSlot::body));
}

// The consumer frees slots when it has taken kMaxBatch or 1/kFreeFraction of the ring, whichever is
// less, or when it is told that the ring is empty.
inline constexpr std::uint32_t kFreeFraction = 8;

// Number of slots of a ring in which `messages` messages of one slot always fit.
[[nodiscard]] constexpr std::uint32_t ringSlotsFor(std::uint32_t messages) noexcept {
  return std::bit_ceil(std::max(16u, messages + messages / (kFreeFraction - 1) + 1));
}

// The second ring of a direction; a direction that has only one has null pointers here.
struct SecondRing {
  layout::Slot* slots = nullptr;
  std::uint32_t capacity = 0;
  layout::Word32* hasMemory = nullptr;  // written by the consumer
  layout::Word64* moved = nullptr;  // written by the producer: 1 + its first position
};

class RingConsumer;
class RingProducer {
 public:
  //   incoming   the ring of the other direction, if there is one
  RingProducer(layout::Slot* slots, std::uint32_t capacity, const layout::RingControl& consumer,
               const SecondRing& second = {}, const RingConsumer* incoming = nullptr) noexcept
      : slots_(slots),
        mask_(capacity - 1),
        consumer_(consumer),
        second_(second),
        incoming_(incoming) {}

  // Pushes `body` (at most layout::kInlineBodyBytes) and returns true. If fewer than `reserve` free
  // slots would remain, changes nothing and returns false.
  [[nodiscard]] bool tryPush(const Envelope& envelope, std::span<const std::byte> body,
                             std::uint32_t reserve = 0) noexcept {
    const auto count = slotsFor(body.size());
    if (!hasFree(count + reserve)) return false;
    auto& first = slot(pushed_);
    write(first, envelope, count, envelope.bodyBytes);
    copyBody(first, body);
    publish(first, count);
    return true;
  }
  // As tryPush(), for a body of at most layout::kFirstSlotBodyBytes. Calls `envelope()` after the
  // checks, so that its values need no stack meanwhile; `bodyBytes` replaces its own.
  template <class MakeEnvelope>
  [[nodiscard, gnu::always_inline]] bool tryPushShort(const MakeEnvelope& envelope,
                                                      std::uint32_t bodyBytes,
                                                      std::span<const std::byte> body,
                                                      std::uint32_t reserve) noexcept {
    if (!hasFree(1 + reserve)) return false;
    if (pushed_ >= claimed_) claimLines();
    auto& first = slot(pushed_);
    write(first, envelope(), 1, bodyBytes);
    if (body.size() == layout::kFirstSlotBodyBytes) [[likely]]
      detail::copyWords<layout::kFirstSlotBodyBytes>(first.body.data(), body.data());
    else if (!body.empty()) std::memcpy(first.body.data(), body.data(), body.size());
    publish(first, 1);
    return true;
  }

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  // Messages that the consumer has not taken, never more than were pushed.
  [[nodiscard]] std::uint64_t waiting() noexcept {
    // PAIR(message-taken): the consumer counts a message before it looks at it.
    takenSeen_ = std::clamp(consumer_.taken.load(std::memory_order_acquire), takenSeen_, messages_);
    return messages_ - takenSeen_;
  }
  // An upper bound of waiting(), from the last value that was read from the consumer.
  [[nodiscard]] std::uint64_t waitingAtMost() const noexcept { return messages_ - takenSeen_; }
  // Whether the consumer has taken the message with this ordinal; the first message has 1.
  [[nodiscard]] bool isTaken(std::uint64_t ordinal) noexcept {
    return messages_ - waiting() >= ordinal;
  }

  // Whether there is a second ring, to which we have not moved.
  [[nodiscard]] bool canMove() const noexcept { return second_.slots != nullptr; }
  [[nodiscard]] bool hasFree(std::uint32_t count) noexcept {
    return pushed_ + count <= freeEnd_ || hasFreed(count);
  }

 private:
  // Lines to claim at once, until the next look at the consumer. In a stream, many: its consumer
  // keeps a distance. Otherwise few: the consumer may be about to read a slot that waits for the
  // transfers of these lines. None when messages go there and back one by one: the consumer polls
  // the next slot and takes its line back at once.
  static constexpr std::uint64_t kFewClaimed = 8, kManyClaimed = 32;
  static constexpr std::uint64_t kFarAhead = 64;  // slots ahead of the consumer
  // Whether this side was idle before nearly each of the messages since the last call.
  [[nodiscard]] bool isOneByOne() noexcept;

  layout::Slot& slot(std::uint64_t position) const noexcept { return slots_[position & mask_]; }

  // Whether the consumer has freed enough since we looked last, or there is room elsewhere.
  [[gnu::noinline]] bool hasFreed(std::uint32_t count) noexcept {
    // PAIR(slot-freed): the consumer has finished reading the slots that we are about to overwrite.
    const auto freed =
        std::clamp(consumer_.freed.load(std::memory_order_acquire), freeEnd_ - usable_, pushed_);
    freeEnd_ = freed + usable_;
    claim_ = isOneByOne() ? 0 : pushed_ - freed < kFarAhead ? kFewClaimed : kManyClaimed;
    return pushed_ + count <= freeEnd_ || (canMove() && tryMove() && count <= usable_);
  }
  // Continues in the second ring, which is empty, if it has memory.
  bool tryMove() noexcept {
    // PAIR(second-ring): the consumer has reserved the memory.
    if (second_.hasMemory->load(std::memory_order_acquire) == 0) return false;
    auto& last = slot(pushed_);  // the one slot that is not usable
    second_.moved->store(pushed_ + 1, std::memory_order_relaxed);
    slots_ = std::exchange(second_.slots, nullptr);
    usable_ = second_.capacity;
    mask_ = usable_ - 1;
    freeEnd_ = pushed_ + usable_;
    claim_ = 0;
    // PAIR(slot-filled): a consumer that sees this sequence continues in the second ring.
    last.sequence.store(layout::kContinuesInSecondRing | (pushed_ + 1), std::memory_order_release);
    MPF_STEP(ring_moved);
    return true;
  }
  // Makes this processor the owner of the lines of the next slots, with a write to each that
  // changes nothing. The transfers of these lines from the consumer's processor overlap; those of
  // messages do not, because the stores of one message fill the store buffer. (prefetchw had no
  // effect here: a processor did not take a line with it that it shared with another one.) If
  // claim_ is 0, the next claim comes after the slots that are known to be free.
  [[gnu::noinline]] void claimLines() noexcept {
    claimed_ = claim_ == 0 ? freeEnd_ : std::min(freeEnd_, pushed_ + claim_);
    if (claim_ == 0) return;
    for (auto position = pushed_; position < claimed_; ++position) {
      volatile auto& field = slot(position).type;
      field = field;
    }
  }

  // In words of 64 bits, because the number of stores limits the rate of messages.
  [[gnu::always_inline]] static void write(layout::Slot& first, const Envelope& envelope,
                                           std::uint32_t slots, std::uint32_t bodyBytes) noexcept {
    using detail::joined;
    auto* const slot = reinterpret_cast<std::byte*>(&first);
    const auto put = [&](auto at, std::uint64_t word) { std::memcpy(slot + at, &word, 8); };
    static_assert(offsetof(layout::Slot, type) == 8 && offsetof(layout::Slot, slots) == 10 &&
                  offsetof(layout::Slot, flags) == 11 && offsetof(layout::Slot, bodyBytes) == 12 &&
                  offsetof(layout::Slot, clientType) == offsetof(layout::Slot, requestId) + 4 &&
                  offsetof(layout::Slot, sentTick) == offsetof(layout::Slot, clientExtra) + 4);
    put(offsetof(layout::Slot, type),
        joined(joined(envelope.type, static_cast<std::uint8_t>(slots), envelope.flags), bodyBytes));
    put(offsetof(layout::Slot, requestId),
        joined(envelope.requestId, static_cast<std::uint32_t>(envelope.clientType)));
    put(offsetof(layout::Slot, clientExtra),
        joined(static_cast<std::uint32_t>(envelope.clientExtra), envelope.sentTick));
    first.deadlineNs = envelope.timeNs;
  }
  void publish(layout::Slot& first, std::uint32_t slots) noexcept {
    MPF_STEP(slot_written);
    const auto sequence = pushed_ + 1;
    pushed_ += slots;
    ++messages_;
    // PAIR(slot-filled): a consumer that sees this sequence sees the whole message.
    first.sequence.store(sequence, std::memory_order_release);
    MPF_STEP(slot_published);
  }
  void copyBody(layout::Slot& first, std::span<const std::byte> body) const noexcept {
    const auto head = std::min(body.size(), first.body.size());
    if (head != 0) std::memcpy(first.body.data(), body.data(), head);
    body = body.subspan(head);
    for (auto position = pushed_ + 1; !body.empty(); ++position) {
      auto& more = reinterpret_cast<layout::MoreSlot&>(slot(position));
      const auto part = std::min(body.size(), more.body.size());
      std::memcpy(more.body.data(), body.data(), part);
      body = body.subspan(part);
    }
  }

  layout::Slot* slots_;
  std::uint64_t mask_;  // number of slots - 1
  const layout::RingControl& consumer_;
  SecondRing second_;  // until we have moved there
  const RingConsumer* incoming_;
  std::uint64_t usable_ = canMove() ? mask_ : mask_ + 1;  // slots that may hold messages
  // End of the slots that the consumer had freed when we looked last.
  std::uint64_t freeEnd_ = usable_;
  std::uint64_t pushed_ = 0;  // slots
  // Lines that are claimed at once; 0: none, as in the first lap, whose lines nobody has read.
  std::uint64_t claim_ = 0;
  std::uint64_t claimed_ = 0;  // the position of the next claim
  std::uint64_t judged_ = 0;  // messages at the last call of isOneByOne()
  std::uint64_t idleSeen_ = 0;  // timesIdle() then
  std::uint64_t messages_ = 0;
  std::uint64_t takenSeen_ = 0;  // private copy of consumer_.taken
};

class RingConsumer {
 public:
  RingConsumer(layout::Slot* slots, std::uint32_t capacity, layout::RingControl& own,
               const SecondRing& second = {}) noexcept
      : slots_(slots), mask_(capacity - 1), own_(own), second_(second), first_(slots) {}

  [[nodiscard]] bool hasMessage() noexcept {
    const auto seen = sequence();
    return seen == taken_ + 1 || (seen == (layout::kContinuesInSecondRing | (taken_ + 1)) &&
                                  tryMove() && sequence() == taken_ + 1);
  }

  // Counts the next message as taken and copies its envelope. Call it only after hasMessage()
  // returned true. From now on the sender sees that we may have acted on the message.
  [[nodiscard]] Envelope begin() noexcept {
    ++messages_;
    // PAIR(message-taken): stored before we look at the message.
    own_.taken.store(messages_, std::memory_order_release);
    MPF_STEP(message_counted);
    const auto& first = *first_;
    slotsNow_ = first.slots;
    return {first.type,       first.flags,       first.bodyBytes, first.requestId,
            first.clientType, first.clientExtra, first.sentTick,  first.deadlineNs};
  }
  // Whether the message begun has one slot.
  [[nodiscard]] bool hasOneSlot() const noexcept { return slotsNow_ == 1; }

  // Body bytes in the slots of the message begun; 0 if its number of slots is invalid.
  [[nodiscard]] std::size_t inlineCapacity() const noexcept {
    if (slotsNow_ < 1 || slotsNow_ > layout::kMaxMessageSlots) return 0;
    return layout::kFirstSlotBodyBytes + (slotsNow_ - 1u) * sizeof(layout::MoreSlot::body);
  }

  // The body bytes in the first slot of the message begun.
  [[nodiscard]] FirstBody firstBody() const noexcept { return FirstBody::of(first_->body.data()); }
  // Copies the body of the message begun. `body` must not be longer than inlineCapacity().
  void copyBody(std::span<std::byte> body) const noexcept {
    const auto& first = *first_;
    const auto head = std::min(body.size(), first.body.size());
    if (head != 0) std::memcpy(body.data(), first.body.data(), head);
    body = body.subspan(head);
    for (auto position = taken_ + 1; !body.empty(); ++position) {
      const auto& more = reinterpret_cast<const layout::MoreSlot&>(slot(position));
      const auto part = std::min(body.size(), more.body.size());
      std::memcpy(body.data(), more.body.data(), part);
      body = body.subspan(part);
    }
  }

  // Ends the message begun. Slots are freed in batches.
  void end() noexcept {
    end(slotsNow_ >= 1 && slotsNow_ <= layout::kMaxMessageSlots ? slotsNow_ : 1u);
  }
  // The same if hasOneSlot().
  void endOneSlot() noexcept { end(1); }
  // The owner has found no message: frees all slots that were taken, and begins a new batch.
  void onEmpty() noexcept {
    if (taken_ != freed_) free();
    if (std::exchange(messagesBeforeIdle_, messages_) != messages_)
      timesIdle_.store(timesIdle() + 1, std::memory_order_relaxed);
    batchEnd_ = taken_ + batch_;
  }

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  // How often onEmpty() was called after further messages. Any thread.
  [[nodiscard]] std::uint64_t timesIdle() const noexcept {
    return timesIdle_.load(std::memory_order_relaxed);
  }

 private:
  layout::Slot& slot(std::uint64_t position) const noexcept { return slots_[position & mask_]; }
  // Of the slot of the next message.
  [[nodiscard]] std::uint64_t sequence() const noexcept {
    // PAIR(slot-filled): the message is complete.
    return first_->sequence.load(std::memory_order_acquire);
  }
  // Follows the producer into the second ring, unless we have not given it memory.
  bool tryMove() noexcept {
    if (second_.slots == nullptr || second_.hasMemory->load(std::memory_order_relaxed) == 0)
      return false;
    slots_ = std::exchange(second_.slots, nullptr);
    mask_ = second_.capacity - 1;
    batch_ = batchOf(second_.capacity);
    first_ = &slot(taken_);
    MPF_STEP(ring_followed);
    return true;
  }

  void end(std::uint32_t slots) noexcept {
    taken_ += slots;
    first_ = &slot(taken_);
    if (taken_ >= batchEnd_) endBatch();
  }
  [[gnu::noinline]] void endBatch() noexcept {
    free();
    batchEnd_ = taken_ + batch_;
    lookAhead();
  }

  static constexpr std::uint64_t kMaxBatch = 16;  // slots
  static constexpr std::uint64_t batchOf(std::uint64_t capacity) noexcept {
    return std::min(kMaxBatch, capacity / kFreeFraction);
  }
  static constexpr std::uint64_t kNear = 64;  // slots; at most a quarter of the ring
  static constexpr std::uint64_t kMaxWaitEvery = 4096;
  static constexpr int kMaxPauses = 100;

  void free() noexcept {
    freed_ = taken_;
    // PAIR(slot-freed): we have finished reading these slots.
    own_.freed.store(freed_, std::memory_order_release);
    MPF_STEP(slots_freed);
  }

  // In a stream of messages, keeps a distance to the producer, and asks for the next lines before
  // they are read. A consumer close behind the producer takes lines away from it that the producer
  // is about to write; then each message costs both sides a transfer of a line.
  void lookAhead() noexcept {
    const auto near = std::min(kNear, (mask_ + 1) / 4);
    if (!isFilledUpTo(taken_ + near) && !tryWaitForProducer(2 * near)) return;
    for (auto position = taken_; position < batchEnd_; ++position)
      __builtin_prefetch(&slot(position));
  }
  [[nodiscard]] bool isFilledUpTo(std::uint64_t end) const noexcept {
    return slot(end - 1).sequence.load(std::memory_order_relaxed) == end;
  }
  // Waits until the producer is this distance ahead, as long as it fills slots. After each failure
  // the next wait is made later: the producer may be waiting for us.
  bool tryWaitForProducer(std::uint64_t distance) noexcept {
    if (taken_ < waitAt_) return false;
    auto end = taken_ + batch_;
    while (end <= taken_ + distance && isFilledSoon(end)) end += batch_;
    const bool isDistant = end > taken_ + distance;
    waitEvery_ = isDistant ? batch_ : std::min(2 * waitEvery_, kMaxWaitEvery);
    waitAt_ = taken_ + waitEvery_;
    return isDistant;
  }
  [[nodiscard]] bool isFilledSoon(std::uint64_t end) const noexcept {
    for (int pauses = 0; !isFilledUpTo(end); ++pauses) {
      if (pauses == kMaxPauses) return false;
      cpuRelax();
    }
    return true;
  }

  layout::Slot* slots_;
  std::uint64_t mask_;  // number of slots - 1
  layout::RingControl& own_;
  SecondRing second_;  // until we have moved there
  const layout::Slot* first_;  // slot(taken_)
  std::uint64_t taken_ = 0;  // slots
  std::uint64_t freed_ = 0;  // private copy of own_.freed
  std::uint64_t batch_ = batchOf(mask_ + 1);  // slots that are freed at once
  std::uint64_t batchEnd_ = batch_;
  std::uint64_t waitAt_ = 0;  // no wait for the producer before this position
  std::uint64_t waitEvery_ = batch_;
  std::uint64_t messages_ = 0;
  std::uint64_t messagesBeforeIdle_ = 0;
  std::atomic<std::uint64_t> timesIdle_{0};
  std::uint8_t slotsNow_ = 0;
};

inline bool RingProducer::isOneByOne() noexcept {
  const auto idle = incoming_ != nullptr ? incoming_->timesIdle() : 0;
  const auto sent = messages_ - std::exchange(judged_, messages_);
  return 4 * (idle - std::exchange(idleSeen_, idle)) >= 3 * sent;
}

}  // namespace mpf
