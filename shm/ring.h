// SPDX-License-Identifier: MIT
// Ring: hands messages of 1 to 4 slots from one producer process to one consumer process.
// The producer is here, the consumer in shm/ring_consumer.h.
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
// Threads  one thread pushes, one thread takes; expectPush(): any.
// Crash    a producer that is killed before its release store has pushed nothing.
// Trust    each end keeps its own positions. Values that the other side writes are range-checked;
//          wrong ones cost messages, never memory safety.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#include <mpf/detail/copy_words.h>

#include "base/step.h"
#include "shm/cache_line.h"
#include "shm/envelope.h"
#include "shm/layout.h"
#include "shm/ring_consumer.h"

namespace mpf {

[[nodiscard]] constexpr std::uint32_t slotsFor(std::size_t inlineBytes) noexcept {
  if (inlineBytes <= layout::kFirstSlotBodyBytes) return 1;
  const auto more = inlineBytes - layout::kFirstSlotBodyBytes;
  return 1 + static_cast<std::uint32_t>((more + sizeof(layout::MoreSlot::body) - 1) /
                                        sizeof(layout::MoreSlot::body));
}

// Number of slots of a ring in which `messages` messages of one slot always fit.
[[nodiscard]] constexpr std::uint32_t ringSlotsFor(std::uint32_t messages) noexcept {
  return std::bit_ceil(std::max(16u, messages + messages / (kFreeFraction - 1) + 1));
}

class RingProducer {
 public:
  //   incoming   the ring of the other direction, if there is one
  //   polledOn   on which processor the consumer polls (LinkControl); nullptr: unknown
  RingProducer(layout::Slot* slots, std::uint32_t capacity, const layout::RingControl& consumer,
               const SecondRing& second = {}, const RingConsumer* incoming = nullptr,
               const layout::Word32* polledOn = nullptr) noexcept
      : slots_(slots),
        mask_(capacity - 1),
        consumer_(consumer),
        second_(second),
        incoming_(incoming),
        polledOn_(polledOn),
        next_(slots) {}

  // Pushes `body` (at most layout::kInlineBodyBytes) and returns true. If fewer than `reserve` free
  // slots would remain, changes nothing and returns false.
  [[nodiscard]] bool tryPush(const Envelope& envelope, std::span<const std::byte> body,
                             std::uint32_t reserve = 0) noexcept {
    const auto count = slotsFor(body.size());
    if (!hasFree(count + reserve)) return false;
    auto& first = next();
    EnvelopeWords::of(envelope, count, envelope.bodyBytes).copyTo(first);
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
    if (pushed_ >= stepEnd_) fetchLines();
    auto& first = next();
    EnvelopeWords::of(envelope(), 1, bodyBytes).copyTo(first);
    if (body.size() == layout::kFirstSlotBodyBytes) [[likely]]
      detail::copyWords<layout::kFirstSlotBodyBytes>(first.body.data(), body.data());
    else if (!body.empty()) std::memcpy(first.body.data(), body.data(), body.size());
    publish(first, 1);
    offer(first, reserve);
    return true;
  }
  // Pushes messages whose bodies fill a slot each and lie one after the other. Stops after `most`
  // messages, before fewer than `reserve` slots would be free, or at the end of the step.
  // Returns the number of messages; 0 if fewer than 1 + `reserve` slots are free. `words(index)`
  // returns the envelope of each.
  template <class MakeWords>
  [[nodiscard, gnu::always_inline]] std::size_t pushRun(const MakeWords& words,
                                                        const std::byte* bodies, std::size_t most,
                                                        std::uint32_t reserve) noexcept {
    if (most == 0 || !hasFree(1 + reserve)) return 0;
    if (pushed_ >= stepEnd_) fetchLines();
    const auto count = std::min({most, freeEnd_ - reserve - pushed_, stepEnd_ - pushed_});
    // Copies: the compiler would load the members again after each store that publishes.
    auto* const slots = slots_;
    const auto mask = mask_;
    auto messages = messages_;
    auto position = pushed_;
    for (std::size_t index = 0; index != count; ++index) {
      auto& message = slots[position & mask];
      words(index).copyTo(message);
      detail::copyWords<layout::kFirstSlotBodyBytes>(message.body.data(), bodies);
      bodies += layout::kFirstSlotBodyBytes;
      showMessages(++messages);
      MPF_STEP(slot_written);
      // PAIR(slot-filled): a consumer that sees this sequence sees the whole message.
      message.sequence.store(++position, std::memory_order_release);
      MPF_STEP(slot_published);
    }
    if (count == 1) offer(slot(pushed_), reserve);
    pushed_ = position;
    next_.store(&slot(pushed_), std::memory_order_relaxed);
    return count;
  }
  // Whether the consumer polled the ring on another processor, at the last look.
  [[nodiscard]] bool isPolledElsewhere() const noexcept { return isPolledElsewhere_; }

  // Fetches the line of the next slot while its message is made: for a thread that has taken a
  // message and will probably send one. Any thread.
  void expectPush() const noexcept { lines::request(&next()); }
  // As expectPush(), but claims the line: a processor may ignore a request for a line that the
  // consumer polls (Zen 4). Does nothing while fetchLines() claims. The thread that pushes.
  void claimNext() noexcept {
    if (step_ == 0 && pushed_ < freeEnd_) lines::claim(next().type);
  }

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  // The same, for any thread. A message is counted before the consumer sees it.
  [[nodiscard]] std::uint64_t countedMessages() noexcept {
    // PAIR(message-counted): sees what the thread that pushes did before.
    return std::atomic_ref(messages_).load(std::memory_order_acquire);
  }
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
  // Steps: after so many slots, lines are fetched and the consumer is looked at. None are fetched
  // for round trips one by one: the consumer polls the next slot and takes its line back at once.
  // There, expectPush() and claimNext() fetch the next line.
  //   near     the consumer may be about to read a slot that waits for the transfers of these lines
  //   stream   the consumer keeps a distance
  static constexpr std::uint64_t kStepNear = 8, kStepInStream = 16;
  static constexpr std::uint64_t kRequestedInStream = 48;  // slots, behind those that are claimed
  static constexpr std::uint64_t kLookEvery = 16;  // slots, if no lines are claimed
  static constexpr std::uint64_t kFarAhead = 64;  // slots ahead of the consumer
  // Whether this side was idle before nearly each of the messages since the last call.
  [[nodiscard]] bool isOneByOne() noexcept;

  layout::Slot& slot(std::uint64_t position) const noexcept { return slots_[position & mask_]; }
  layout::Slot& next() const noexcept { return *next_.load(std::memory_order_relaxed); }

  // Whether the consumer has freed enough since we looked last, or there is room elsewhere.
  [[gnu::noinline]] bool hasFreed(std::uint32_t count) noexcept {
    // PAIR(slot-freed): the consumer has finished reading the slots that we are about to overwrite.
    const auto freed =
        std::clamp(consumer_.freed.load(std::memory_order_acquire), freeEnd_ - usable_, pushed_);
    freeEnd_ = freed + usable_;
    step_ = isOneByOne() ? 0 : pushed_ - freed < kFarAhead ? kStepNear : kStepInStream;
    return pushed_ + count <= freeEnd_ || (canMove() && tryMove() && count <= usable_);
  }
  // Continues in the second ring, which is empty, if it has memory.
  bool tryMove() noexcept {
    // PAIR(second-ring): the consumer has reserved the memory.
    if (second_.hasMemory->load(std::memory_order_acquire) == 0) return false;
    auto& last = next();  // the one slot that is not usable
    second_.moved->store(pushed_ + 1, std::memory_order_relaxed);
    slots_ = std::exchange(second_.slots, nullptr);
    usable_ = second_.capacity;
    mask_ = usable_ - 1;
    freeEnd_ = pushed_ + usable_;
    step_ = 0;
    next_.store(&slot(pushed_), std::memory_order_relaxed);
    // PAIR(slot-filled): a consumer that sees this sequence continues in the second ring.
    last.sequence.store(layout::kContinuesInSecondRing | (pushed_ + 1), std::memory_order_release);
    MPF_STEP(ring_moved);
    return true;
  }
  // Fetches the lines of free slots, so that their transfers from the consumer's processor overlap;
  // those of messages do not, because the stores of one message fill the store buffer. Claims the
  // next lines. In a stream, requests further ones, each up to three times: on a processor where
  // requests have an effect, these lines arrive while other slots are filled, and later claims need
  // not wait for them. Near the consumer, requests would take lines from it that it still reads. If
  // step_ is 0, only looks where the consumer polls.
  [[gnu::noinline]] void fetchLines() noexcept {
    const auto polledOn = polledOn_ != nullptr ? polledOn_->load(std::memory_order_relaxed) : 0;
    const auto here = lines::thisProcessor();
    isPolledElsewhere_ = polledOn != 0 && here != 0 && polledOn != here;
    stepEnd_ = std::min(freeEnd_, pushed_ + (step_ == 0 ? kLookEvery : step_));
    if (step_ == 0) return;
    if (stepEnd_ == freeEnd_) __builtin_prefetch(&consumer_.freed);  // hasFreed() looks at it soon
    for (auto position = pushed_; position < stepEnd_; ++position)
      lines::claim(slot(position).type);
    if (step_ == kStepNear) return;
    const auto end = std::min(freeEnd_, stepEnd_ + kRequestedInStream);
    for (auto position = stepEnd_; position < end; ++position) lines::request(&slot(position));
  }

  [[gnu::always_inline]] void publish(layout::Slot& first, std::uint32_t slots) noexcept {
    MPF_STEP(slot_written);
    const auto begin = pushed_;
    const auto end = begin + slots;
    pushed_ = end;
    showMessages(messages_ + 1);
    // PAIR(slot-filled): a consumer that sees this sequence sees the whole message.
    first.sequence.store(begin + 1, std::memory_order_release);
    MPF_STEP(slot_published);
    next_.store(&slot(end), std::memory_order_relaxed);
  }
  // Before the message is published.
  void showMessages(std::uint64_t messages) noexcept {
    // PAIR(message-counted): a thread that sees the number sees what was done before.
    std::atomic_ref(messages_).store(messages, std::memory_order_release);
  }
  // Sends the line of a single message towards the processor that polls for it. A message with a
  // reserve is one of a stream. Its receiver is behind, so this would only cost time.
  void offer(const layout::Slot& message, std::uint32_t reserve) const noexcept {
    if (isPolledElsewhere_ && reserve == 0) lines::offer(&message);
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
  const layout::Word32* polledOn_;
  std::uint64_t usable_ = canMove() ? mask_ : mask_ + 1;  // slots that may hold messages
  // End of the slots that the consumer had freed when we looked last.
  std::uint64_t freeEnd_ = usable_;
  std::uint64_t pushed_ = 0;  // slots
  std::atomic<layout::Slot*> next_;  // slot(pushed_)
  // kStepNear, kStepInStream, or 0, as in the first lap, whose lines nobody has read.
  std::uint64_t step_ = 0;
  std::uint64_t stepEnd_ = 0;  // the position of the next fetchLines()
  bool isPolledElsewhere_ = false;  // at the last look
  std::uint64_t judged_ = 0;  // messages at the last call of isOneByOne()
  std::uint64_t idleSeen_ = 0;  // timesIdle() then
  std::uint64_t messages_ = 0;  // stored and read by other threads atomically
  std::uint64_t takenSeen_ = 0;  // private copy of consumer_.taken
};

inline bool RingProducer::isOneByOne() noexcept {
  const auto idle = incoming_ != nullptr ? incoming_->timesIdle() : 0;
  const auto sent = messages_ - std::exchange(judged_, messages_);
  return 4 * (idle - std::exchange(idleSeen_, idle)) >= 3 * sent;
}

}  // namespace mpf
