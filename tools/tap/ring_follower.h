// SPDX-License-Identifier: MIT
// RingFollower: reads the messages of a ring in addition to its consumer. It writes nothing, and
// neither producer nor consumer waits for it.
//
//   | half of the ring: safe to read | half: the producer may be overwriting it |
//
// It follows the producer into the second ring, if there is one.
//
// A message stays in the ring until the producer reuses its slots. The follower copies it and then
// reads the position of the producer: if that is less than half a ring ahead, the copy is
// consistent. Otherwise the follower reports an overrun and continues a quarter of the ring behind
// the newest message, so that it can read some messages before the next overrun.
//
// Threads  one.
// Crash    the producer may die at any time; the messages that it published are read.
// Trust    a producer that writes invalid data costs messages, never memory safety.
// Order    the copy is consistent only if no store is delayed past half a ring of later stores.
//          This holds for all known CPUs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/ring.h"

namespace mpf::tools {

// A copy of a message in the ring.
struct RingCopy {
  Envelope envelope;
  std::array<std::byte, layout::kInlineBodyBytes> bytes{};
  std::size_t size = 0;  // of an inline body; of the ChunkRef of a kSlotChunk message
  [[nodiscard]] std::span<const std::byte> body() const noexcept { return {bytes.data(), size}; }
};

enum class FollowFrom {
  first,  // with the first message that was ever sent
  newest,  // behind the newest message
};

class RingFollower {
 public:
  // `capacity` is a power of two, at least 16, and so is that of the second ring, if there is one.
  RingFollower(std::span<const layout::Slot> ring, std::span<const layout::Slot> second,
               FollowFrom from) noexcept;

  enum class Next { nothing, message, overrun };
  // `overrun`: the producer was too fast; the next call continues at a later message.
  Next tryNext(RingCopy& copy) noexcept;

 private:
  [[nodiscard]] const layout::Slot& slot(std::uint64_t position) const noexcept {
    return slots_[position & (capacity_ - 1)];
  }
  [[nodiscard]] bool isPossible(std::uint64_t sequence, std::uint64_t position) const noexcept;
  [[nodiscard]] bool isFilled(std::uint64_t position) const noexcept;
  [[nodiscard]] bool isOverrun() const noexcept;
  [[nodiscard]] bool continuesAt(std::uint64_t position) const noexcept;
  void moveTo(std::uint64_t position) noexcept;
  void goBehindNewest() noexcept;
  void goBack() noexcept;
  bool tryCopy(std::uint32_t slots, RingCopy& copy) const noexcept;

  const layout::Slot* slots_;
  std::uint64_t capacity_;
  std::span<const layout::Slot> second_;  // until the follower has moved there
  std::uint64_t position_ = 0;  // where the next message begins
};

}  // namespace mpf::tools
