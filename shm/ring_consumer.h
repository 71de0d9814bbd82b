// SPDX-License-Identifier: MIT
// RingConsumer: takes the messages of a ring (shm/ring.h).
//
// Threads  one; timesIdle() any.
// Crash    a consumer that is killed after it counted a message as taken may or may not have acted
//          on it.
// Trust    a producer that writes invalid data costs messages, never memory safety.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#include <mpf/detail/copy_words.h>

#include "base/step.h"
#include "shm/cache_line.h"
#include "shm/cpu_relax.h"
#include "shm/envelope.h"
#include "shm/layout.h"

namespace mpf {

// The consumer frees slots when it has taken kMaxBatch or 1/kFreeFraction of the ring, whichever is
// less, or when it is told that the ring is empty.
inline constexpr std::uint32_t kFreeFraction = 8;

// The second ring of a direction; a direction that has only one has null pointers here.
struct SecondRing {
  layout::Slot* slots = nullptr;
  std::uint32_t capacity = 0;
  layout::Word32* hasMemory = nullptr;  // written by the consumer
  layout::Word64* moved = nullptr;  // written by the producer: 1 + its first position
};

class RingConsumer {
 public:
  //   polledOn   on which processor the owner polls (LinkControl); nullptr: not reported
  RingConsumer(layout::Slot* slots, std::uint32_t capacity, layout::RingControl& own,
               const SecondRing& second = {}, layout::Word32* polledOn = nullptr) noexcept
      : slots_(slots),
        mask_(capacity - 1),
        own_(own),
        second_(second),
        polledOn_(polledOn),
        first_(slots) {}

  [[nodiscard]] bool hasMessage() noexcept {
    const auto seen = sequence();
    return seen == taken_ + 1 || (seen == (layout::kContinuesInSecondRing | (taken_ + 1)) &&
                                  tryMove() && sequence() == taken_ + 1);
  }

  // The type of the next message, after hasMessage().
  [[nodiscard]] std::uint16_t nextType() const noexcept { return detail::alone(first_->type); }
  // Whether another message follows the next one, if that has one slot.
  [[nodiscard]] bool hasSecond() const noexcept { return isFilled(taken_ + 1); }
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
  // The reference in the first slot of the message begun, whose body is in a chunk.
  [[nodiscard, gnu::always_inline]] layout::ChunkRef chunkRef() const noexcept {
    using layout::ChunkRef;
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, first_->body.data() + at, sizeof value);
      return detail::alone(value);  // read once: a peer may change it
    };
    return {word(offsetof(ChunkRef, segment)), word(offsetof(ChunkRef, chunk)),
            word(offsetof(ChunkRef, side)), word(offsetof(ChunkRef, missed)),
            word(offsetof(ChunkRef, cmd))};
  }
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
  // Takes the next messages together, as long as each has the next sequence and accept(words) is
  // true for its envelope; at most `most`, and not beyond the end of the batch. accept() lets only
  // messages of one slot pass. Counts all of them as taken before it reads a body. Calls
  // `take(count, body)`, where `body(index)` is the body of each; returns their number.
  template <class Accept, class Take>
  [[gnu::always_inline]] std::uint64_t takeRun(std::uint64_t most, const Accept& accept,
                                               const Take& take) noexcept {
    most = std::min(most, batchEnd_ - taken_);
    // Copies: the compiler would load the members again for each message.
    const auto* const slots = slots_;
    const auto mask = mask_;
    const auto begin = taken_;
    const auto at = [=](std::uint64_t index) -> const layout::Slot& {
      return slots[(begin + index) & mask];
    };
    std::uint64_t count = 0;
    // PAIR(slot-filled): the message is complete.
    while (count < most &&
           at(count).sequence.load(std::memory_order_acquire) == begin + count + 1 &&
           accept(EnvelopeWords::in(at(count))))
      ++count;
    if (count == 0) return 0;
    messages_ += count;
    // PAIR(message-taken): stored before we look at the bodies.
    own_.taken.store(messages_, std::memory_order_release);
    MPF_STEP(message_counted);
    take(count, [&](std::uint64_t index) { return FirstBody::of(at(index).body.data()); });
    end(count);
    return count;
  }
  // The owner has found no message: frees all slots that were taken, and begins a new batch.
  void onEmpty() noexcept {
    if (taken_ != freed_) free();
    if (std::exchange(messagesBeforeIdle_, messages_) != messages_)
      timesIdle_.store(timesIdle() + 1, std::memory_order_relaxed);
    batchEnd_ = taken_ + batch_;
  }

  // The owner starts or stops polling.
  void showPolling(bool polls) noexcept {
    if (polledOn_ == nullptr) return;
    const auto processor = polls ? lines::thisProcessor() : 0;
    if (polledOn_->load(std::memory_order_relaxed) != processor)
      polledOn_->store(processor, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  // Whether the last message begun is the first one since onEmpty(), or the first of all.
  [[nodiscard]] bool wasIdle() const noexcept { return messages_ == messagesBeforeIdle_ + 1; }
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

  // Whether the message of this position, which has one slot, is complete.
  [[nodiscard]] bool isFilled(std::uint64_t position) const noexcept {
    // PAIR(slot-filled): the message is complete.
    return slot(position).sequence.load(std::memory_order_acquire) == position + 1;
  }

  void end(std::uint64_t slots) noexcept {
    taken_ += slots;
    first_ = &slot(taken_);
    // Its line arrives while the message that was taken is handled.
    __builtin_prefetch(first_);
    if (taken_ >= batchEnd_) endBatch();
  }
  [[gnu::noinline]] void endBatch() noexcept {
    free();
    batchEnd_ = taken_ + batch_;
    lookAhead();
    // The thread may have moved to another processor.
    if (polledOn_ != nullptr && polledOn_->load(std::memory_order_relaxed) != 0) showPolling(true);
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

  // In a stream of messages, keeps a distance to the producer, and fetches the next lines before
  // they are read, if they are filled. A consumer close behind the producer takes lines away from
  // it that the producer is about to write; then each message costs both sides a transfer of a
  // line.
  void lookAhead() noexcept {
    const auto near = std::min(kNear, (mask_ + 1) / 4);
    const bool isFilled =
        isFilledUpTo(taken_ + near) || tryWaitForProducer(2 * near) || isFilledUpTo(batchEnd_);
    if (!isFilled) return;
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
  layout::Word32* polledOn_;
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

}  // namespace mpf
