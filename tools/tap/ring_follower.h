// SPDX-License-Identifier: MIT
// RingFollower: reads the messages of a ring beside its consumer, without taking part: it writes
// nothing, and nobody waits for it.
//
//   | half of the ring: what a follower may still read | half: what the producer may be overwriting |
//
// A message lies in the ring until the producer comes round to it. The follower copies it and then
// looks where the producer is: less than half a ring ahead, and the copy is whole. Else the
// follower goes on behind the newest message, and says that it missed some.
//
// Threads  one.
// Crash    the producer may die at any time; what it published is read.
// Trust    a producer that writes nonsense costs messages, never memory safety.
// Order    that the copy is whole rests on a store not being delayed past half a ring of later
//          ones: true of every CPU we know of.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/ring.h"

namespace mpf::tools {

// A message as it lay in the ring.
struct RingCopy {
  Envelope envelope;
  std::array<std::byte, layout::kInlineBodyBytes> bytes{};
  std::size_t size = 0;  // of the body in line; of a kSlotChunk message, of its ChunkRef
  [[nodiscard]] std::span<const std::byte> body() const noexcept { return {bytes.data(), size}; }
};

enum class FollowFrom {
  first,  // the first message that was ever sent
  newest,  // behind the newest
};

class RingFollower {
 public:
  // `capacity` is a power of two, at least 16.
  RingFollower(const layout::Slot* slots, std::uint32_t capacity, FollowFrom from) noexcept;

  enum class Next { nothing, message, overrun };
  // `overrun`: the producer was too fast; go on behind the newest message.
  Next tryNext(RingCopy& copy) noexcept;

 private:
  [[nodiscard]] const layout::Slot& slot(std::uint64_t position) const noexcept {
    return slots_[position & (capacity_ - 1)];
  }
  [[nodiscard]] bool isPossible(std::uint64_t sequence, std::uint64_t position) const noexcept;
  [[nodiscard]] bool isOverrun() const noexcept;
  void goBehindNewest() noexcept;
  bool tryCopy(std::uint32_t slots, RingCopy& copy) const noexcept;

  const layout::Slot* slots_;
  std::uint64_t capacity_;
  std::uint64_t position_ = 0;  // where the next message begins
};

}  // namespace mpf::tools
