// SPDX-License-Identifier: MIT
#include "tools/tap/ring_follower.h"

#include <algorithm>

namespace mpf::tools {
namespace {

constexpr std::uint64_t kMost = std::uint64_t{1} << 62;  // no ring can reach this position

}  // namespace

RingFollower::RingFollower(std::span<const layout::Slot> ring, std::span<const layout::Slot> second,
                           FollowFrom from) noexcept
    : slots_(ring.data()), capacity_(ring.size()), second_(second) {
  if (from == FollowFrom::newest) goBehindNewest();
}

// Whether a sequence number can belong to the slot of `position`. Others, among them the 0 of an
// empty slot, must not make the follower look for newer messages.
bool RingFollower::isPossible(std::uint64_t sequence, std::uint64_t position) const noexcept {
  return sequence - 1 < kMost && ((sequence - 1 - position) & (capacity_ - 1)) == 0;
}

// Whether the message of this position is complete.
bool RingFollower::isFilled(std::uint64_t position) const noexcept {
  // PAIR(slot-filled): the message is complete.
  const auto sequence = slot(position).sequence.load(std::memory_order_acquire);
  return sequence == position + 1 && isPossible(sequence, position);
}

// Whether the message of this position, and all later ones, are in the second ring.
bool RingFollower::continuesAt(std::uint64_t position) const noexcept {
  // PAIR(slot-filled): the producer has moved before it filled a slot of the second ring.
  const auto sequence = slot(position).sequence.load(std::memory_order_acquire);
  return !second_.empty() && sequence == (layout::kContinuesInSecondRing | (position + 1));
}

void RingFollower::moveTo(std::uint64_t position) noexcept {
  slots_ = second_.data();
  capacity_ = second_.size();
  second_ = {};
  position_ = position;
}

// The newest message is the one in the slot with the highest sequence number.
void RingFollower::goBehindNewest() noexcept {
  std::uint64_t newest = 0;
  std::uint8_t slots = 1;
  for (std::uint64_t index = 0; index < capacity_; ++index) {
    const auto continued =
        slots_[index].sequence.load(std::memory_order_relaxed) & ~layout::kContinuesInSecondRing;
    if (isPossible(continued, index) && continuesAt(continued - 1)) {
      moveTo(continued - 1);
      return goBehindNewest();
    }
    // PAIR(slot-filled): the message is complete.
    const auto sequence = slots_[index].sequence.load(std::memory_order_acquire);
    if (sequence <= newest || !isPossible(sequence, index)) continue;
    newest = sequence;
    slots = slots_[index].slots;
  }
  if (newest != 0)
    position_ = newest - 1 + std::clamp<std::uint32_t>(slots, 1, layout::kMaxMessageSlots);
}

// From behind the newest message to an earlier one: at most a quarter of the ring back.
void RingFollower::goBack() noexcept {
  const auto newest = position_;
  position_ -= std::min(newest, capacity_ / 4);
  while (position_ != newest && !isFilled(position_)) ++position_;
}

// Whether the producer is more than half a ring ahead. Of any kMaxMessageSlots successive slots
// that the producer has passed, at least one is the first slot of a message and has its sequence
// number.
bool RingFollower::isOverrun() const noexcept {
  for (std::uint32_t i = 0; i < layout::kMaxMessageSlots; ++i) {
    const auto ahead = position_ + capacity_ / 2 + i;
    const auto sequence = slot(ahead).sequence.load(std::memory_order_relaxed);
    if (sequence > ahead && isPossible(sequence, ahead)) return true;
  }
  return false;
}

RingFollower::Next RingFollower::tryNext(RingCopy& copy) noexcept {
  if (continuesAt(position_)) moveTo(position_);
  const bool filled = isFilled(position_);
  const auto slots = slot(position_).slots;
  const bool whole = filled && tryCopy(slots, copy);
  // PAIR(slot-filled): the message is copied first, and then the producer's position is read.
  std::atomic_thread_fence(std::memory_order_acquire);
  if (isOverrun()) {
    goBehindNewest();
    goBack();
    return Next::overrun;
  }
  if (filled && !whole) {
    goBehindNewest();
    return Next::overrun;
  }
  if (!filled) return Next::nothing;
  position_ += slots;
  return Next::message;
}

// False when the slots contain invalid data.
bool RingFollower::tryCopy(std::uint32_t slots, RingCopy& copy) const noexcept {
  const auto& first = slot(position_);
  if (slots < 1 || slots > layout::kMaxMessageSlots) return false;
  copy.envelope = {first.type,       first.flags,       first.bodyBytes, first.requestId,
                   first.clientType, first.clientExtra, first.sentTick,  first.deadlineNs};
  const bool isChunk = (copy.envelope.flags & layout::kSlotChunk) != 0;
  copy.size = isChunk ? sizeof(layout::ChunkRef) : copy.envelope.bodyBytes;
  if (copy.size > layout::kFirstSlotBodyBytes + (slots - 1) * sizeof(layout::MoreSlot::body))
    return false;
  auto left = std::span(copy.bytes).first(copy.size);
  const auto take = [&](const auto& from) {
    const auto part = std::min(left.size(), from.size());
    std::copy_n(from.begin(), part, left.begin());
    left = left.subspan(part);
  };
  take(first.body);
  for (std::uint32_t i = 1; i < slots; ++i)
    take(reinterpret_cast<const layout::MoreSlot&>(slot(position_ + i)).body);
  return true;
}

}  // namespace mpf::tools
