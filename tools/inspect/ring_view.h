// SPDX-License-Identifier: MIT
// RingView: the last messages of a ring, from a copy of its slots. Slots keep a message until the
// producer overwrites them.
//
//   positions   ... freed ──────── taken by the consumer ──────── end ...
//   state          freed    taken                      waiting     unpublished
//
// The producer may be writing at `end`, over the oldest messages. A second copy, made after the
// first, shows how far the producer has got: messages that it may have overwritten while the first
// copy was made are left out.
//
// Threads  one.
// Trust    slots are untrusted: a message is shown only if its sequence number fits its slot.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shm/layout.h"

namespace mpf::tools {

enum class MessageState {
  waiting,      // published, not taken
  taken,        // taken; the consumer may still be reading it
  freed,        // taken, and the producer may overwrite its slots
  unpublished,  // begun, but not published: its sender is writing it, or died while writing
};
[[nodiscard]] const char* toString(MessageState state) noexcept;

struct RingMessage {
  std::uint64_t position = 0;
  MessageState state{};
  std::span<const layout::Slot> first;  // the first slot, in the copy
  std::vector<std::byte> bytes;         // all slots, one after the other
  // The part of the body that is in the slots.
  [[nodiscard]] std::vector<std::byte> inlineBody() const;
};

// The counters of a ring, which its two ends write.
struct RingWords {
  std::uint64_t freed = 0, taken = 0, sent = 0;
  [[nodiscard]] std::uint64_t waiting() const noexcept { return sent > taken ? sent - taken : 0; }
};

struct RingView {
  std::uint64_t end = 0;  // position of the next message
  // Number of messages that are left out because they may have been overwritten.
  std::uint64_t overwritten = 0;
  std::vector<RingMessage> messages;  // the oldest first; they point into the copy

  // `later` is the second copy and `laterFreed` its counter; both are the same as the first copy
  // when no process writes any more.
  static RingView of(std::span<const layout::Slot> slots, const RingWords& words,
                     std::span<const layout::Slot> later, std::uint64_t laterFreed);
};

}  // namespace mpf::tools
