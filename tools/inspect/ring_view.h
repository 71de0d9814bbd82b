// SPDX-License-Identifier: MIT
// RingView: the last messages of a ring, from a copy of its slots, which keep what was sent until
// it is overwritten.
//
//   positions   ... freed ──────── taken by the consumer ──────── end ...
//   state          freed    taken                      waiting     unpublished
//
// The producer may be writing at `end`, over the oldest messages. A second copy, made after the
// first, says how far it has come: what may have been overwritten meanwhile is left out.
//
// Threads  one.
// Trust    slots may hold anything: a message is believed only where its sequence says that it may
//          be.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shm/layout.h"

namespace mpf::tools {

enum class MessageState {
  waiting,  // published, not taken
  taken,  // taken; the consumer may be at work on it
  freed,  // taken, and its slots may be overwritten
  unpublished,  // begun, and not published: its sender is writing it, or died there
};
[[nodiscard]] const char* toString(MessageState state) noexcept;

struct RingMessage {
  std::uint64_t position = 0;
  MessageState state{};
  std::span<const layout::Slot> first;  // the first slot, in the copy
  std::vector<std::byte> bytes;  // all slots, one after the other
  // The part of the body that is in the slots.
  [[nodiscard]] std::vector<std::byte> inlineBody() const;
};

// What both ends say of a ring.
struct RingWords {
  std::uint64_t freed = 0, taken = 0, sent = 0;
  [[nodiscard]] std::uint64_t waiting() const noexcept { return sent > taken ? sent - taken : 0; }
};

struct RingView {
  std::uint64_t end = 0;  // position of the next message
  // messages of the copy that may have been overwritten while it was made
  std::uint64_t overwritten = 0;
  std::vector<RingMessage> messages;  // the oldest first; they point into the copy

  // `later` is the second copy, with what was freed by then; the same as the first when nobody
  // writes any more.
  static RingView of(std::span<const layout::Slot> slots, const RingWords& words,
                     std::span<const layout::Slot> later, std::uint64_t laterFreed);
};

}  // namespace mpf::tools
