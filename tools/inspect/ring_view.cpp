// SPDX-License-Identifier: MIT
#include "tools/inspect/ring_view.h"

#include <algorithm>
#include <cstring>

namespace mpf::tools {
namespace {

struct Head {
  std::uint64_t position;
  std::uint32_t slots;
};

std::uint64_t sequenceOf(const layout::Slot& slot) noexcept {
  return slot.sequence.load(std::memory_order_relaxed);
}

// First slots of messages, the newest first, without messages of which a newer message has reused a
// slot. Positions outside of [low, high) are invalid data and are left out.
std::vector<Head> headsOf(std::span<const layout::Slot> slots, std::uint64_t low,
                          std::uint64_t high) {
  const std::uint64_t capacity = slots.size();
  std::vector<Head> candidates;
  for (std::uint64_t index = 0; index < capacity; ++index) {
    const auto position = sequenceOf(slots[index]) - 1;  // of an empty slot it is past every `high`
    if (position < low || position >= high || position % capacity != index) continue;
    const auto count = slots[index].slots;
    candidates.push_back({position, count >= 1 && count <= layout::kMaxMessageSlots ? count : 1u});
  }
  std::ranges::sort(candidates, std::ranges::greater{}, &Head::position);
  std::vector<Head> heads;
  for (const auto& head : candidates) {
    const bool isWhole =
        heads.empty() || (head.position + head.slots <= heads.back().position &&
                          head.position + capacity >= heads.front().position + heads.front().slots);
    if (isWhole) heads.push_back(head);
  }
  return heads;
}

std::uint64_t endOf(const std::vector<Head>& heads, std::uint64_t freed) noexcept {
  return heads.empty() ? freed : heads.front().position + heads.front().slots;
}

RingMessage messageAt(std::span<const layout::Slot> slots, const Head& head, MessageState state) {
  RingMessage message{head.position, state, slots.subspan(head.position % slots.size(), 1), {}};
  message.bytes.resize(head.slots * sizeof(layout::Slot));
  for (std::uint32_t i = 0; i < head.slots; ++i) {
    std::memcpy(message.bytes.data() + i * sizeof(layout::Slot),
                static_cast<const void*>(&slots[(head.position + i) % slots.size()]),
                sizeof(layout::Slot));
  }
  return message;
}

// Whether the producer has begun to write the message at `end`. This is visible in the first lap
// only, in which slots that have not been written are zero.
bool isBegun(std::span<const layout::Slot> slots, std::uint64_t end) {
  const layout::Slot empty{};
  const auto& slot = slots[end % slots.size()];
  return end < slots.size() && std::memcmp(static_cast<const void*>(&slot),
                                           static_cast<const void*>(&empty), sizeof slot) != 0;
}

}  // namespace

const char* toString(MessageState state) noexcept {
  switch (state) {
    case MessageState::waiting:
      return "waiting";
    case MessageState::taken:
      return "taken";
    case MessageState::freed:
      return "freed";
    case MessageState::unpublished:
      return "unpublished";
  }
  return "unknown";
}

std::vector<std::byte> RingMessage::inlineBody() const {
  std::vector<std::byte> body;
  for (std::size_t slot = 0; slot < bytes.size(); slot += sizeof(layout::Slot)) {
    const auto start =
        slot + (slot == 0 ? offsetof(layout::Slot, body) : offsetof(layout::MoreSlot, body));
    body.insert(body.end(), bytes.begin() + static_cast<std::ptrdiff_t>(start),
                bytes.begin() + static_cast<std::ptrdiff_t>(slot + sizeof(layout::Slot)));
  }
  return body;
}

RingView RingView::of(std::span<const layout::Slot> slots, const RingWords& words,
                      std::span<const layout::Slot> later, std::uint64_t laterFreed) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 62;  // no ring can reach this position
  const std::uint64_t capacity = slots.size();
  RingView view;
  view.end = words.freed;
  if (capacity == 0 || later.size() != capacity || std::max(words.freed, laterFreed) > kMost)
    return view;
  const auto low = words.freed - std::min(words.freed, capacity);
  const auto heads = headsOf(slots, low, laterFreed + capacity);
  view.end = endOf(heads, words.freed);
  // The end of what the producer may have written when `later` was copied: all published messages,
  // and one more that it may have been writing.
  const bool isStill = later.data() == slots.data();
  const auto reached = isStill ? view.end
                               : endOf(headsOf(later, low, laterFreed + 4 * capacity), view.end) +
                                     layout::kMaxMessageSlots;
  std::uint64_t newer = 0;
  for (const auto& head : heads) {
    const auto state = head.position < words.freed ? MessageState::freed
                       : newer < words.waiting()   ? MessageState::waiting
                                                   : MessageState::taken;
    ++newer;
    if (head.position + capacity < reached) ++view.overwritten;
    else view.messages.push_back(messageAt(slots, head, state));
  }
  std::ranges::reverse(view.messages);
  if (isBegun(slots, view.end))
    view.messages.push_back(messageAt(slots, {view.end, 1}, MessageState::unpublished));
  return view;
}

}  // namespace mpf::tools
