// SPDX-License-Identifier: MIT
// SniffQueue: passes bytes of the line from the port's thread to the thread of the sniff server.
//
//   port's thread ── push ──► | at most maxBytes bytes | ── take ──► sniff server's thread,
//                                                       when the batch is large or old enough
//
// Threads  one thread pushes and one takes. The mutex is held for a copy or a swap, never while a
//          message is sent.
#pragma once

#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/serial/peek_taps.h>

namespace mpf {

struct SniffBatching {
  Nanoseconds maxAge = std::chrono::milliseconds(20);  // longest wait of a byte for further ones
  std::size_t largeBytes = 256;  // a batch of this size does not wait
  std::size_t maxBytes = 16384;  // capacity of the queue; further bytes are lost
};

class SniffQueue {
 public:
  explicit SniffQueue(const SniffBatching& batching);

  // Adds the bytes that fit, and counts the rest as lost. Returns true when dueAt() has changed.
  [[nodiscard]] bool push(std::span<const PeekedByte> bytes);
  // When take() must be called; never while the queue is empty.
  [[nodiscard]] Deadline dueAt() const;
  // Moves all bytes into `bytes`, whose memory is reused. Returns the number of bytes that were
  // lost after them.
  std::uint64_t take(std::vector<PeekedByte>& bytes);

 private:
  const SniffBatching batching_;
  mutable std::mutex mutex_;
  std::vector<PeekedByte> bytes_;  // under mutex_, as all below
  Deadline firstIsOld_ = Deadline::never();
  std::uint64_t lost_ = 0;
};

}  // namespace mpf
