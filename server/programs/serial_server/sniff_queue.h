// SPDX-License-Identifier: MIT
// SniffQueue: bytes of the line on their way from the port's thread to the listeners' one.
//
//   port's thread ── push ──► | bytes, at most so many | ── take ──► listeners' thread, once the batch is large or old enough
//
// Threads  one pushes and one takes. Pushing copies under a mutex that is held for a copy or a
//          swap, never for a message.
#pragma once

#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/serial/peek_taps.h>

namespace mpf {

struct SniffBatching {
  Nanoseconds maxAge = std::chrono::milliseconds(20);  // a byte waits for others no longer
  std::size_t largeBytes = 256;  // nor do so many
  std::size_t maxBytes = 16384;  // what comes on top is lost
};

class SniffQueue {
 public:
  explicit SniffQueue(const SniffBatching& batching);

  // Takes what there is room for, and counts the rest as lost. True: dueAt() is another now.
  [[nodiscard]] bool push(std::span<const PeekedByte> bytes);
  // When to take; never when there is nothing.
  [[nodiscard]] Deadline dueAt() const;
  // Moves all bytes into `bytes`, whose memory is used again. Returns how many were lost after
  // them.
  std::uint64_t take(std::vector<PeekedByte>& bytes);

 private:
  const SniffBatching batching_;
  mutable std::mutex mutex_;
  std::vector<PeekedByte> bytes_;  // under mutex_, as all below
  Deadline firstIsOld_ = Deadline::never();
  std::uint64_t lost_ = 0;
};

}  // namespace mpf
