// SPDX-License-Identifier: MIT
// SniffQueue: passes records of bytes from the thread of a line to that of the sniff server.
//
//   line's thread ── push ──► | at most maxBytes records | ── take ──► sniff server's thread,
//                                                         when the batch is large or old enough
//
// Threads  one thread pushes and one takes. The mutex is held for a copy or a swap, never while a
//          message is sent.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include <mpf/clock.h>
#include <mpf/serial_sniff.h>

namespace mpf {

// A record of one byte, as it is in a message.
using SniffBytes = std::array<char, serial::SniffRecord::kBytes>;

struct SniffBatching {
  Nanoseconds maxAge = std::chrono::milliseconds(20);  // longest wait of a byte for further ones
  std::size_t largeBytes = 256;  // a batch of this size does not wait
  std::size_t maxBytes = 16384;  // capacity of the queue; further bytes are lost
};

class SniffQueue {
 public:
  explicit SniffQueue(const SniffBatching& batching);

  // Adds the records that fit, and counts the rest as lost. Returns true when dueAt() has changed.
  [[nodiscard]] bool push(std::span<const SniffBytes> records);
  // When take() must be called; never while the queue is empty.
  [[nodiscard]] Deadline dueAt() const;
  // Moves all records into `records`, whose memory is reused. Returns the number of bytes that were
  // lost after them.
  std::uint64_t take(std::vector<SniffBytes>& records);

 private:
  const SniffBatching batching_;
  mutable std::mutex mutex_;
  std::vector<SniffBytes> records_;  // under mutex_, as all below
  Deadline firstIsOld_ = Deadline::never();
  std::uint64_t lost_ = 0;
};

}  // namespace mpf
