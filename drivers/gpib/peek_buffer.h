// SPDX-License-Identifier: MIT
// GpibPeekBuffer: collects the bytes of an operation for a peek handler, which costs less than a
// call for each byte.
//
// Threads  one at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf {

class GpibPeekBuffer {
 public:
  void setHandler(GpibPeekHandler handler) {
    flush();
    handler_ = std::move(handler);
  }
  void add(std::uint8_t value, bool attention, bool end, GpibDirection direction) {
    if (!handler_) return;
    bytes_.at(count_++) = {Clock::nowNs(), value, attention, end, direction};
    if (count_ == bytes_.size()) flush();
  }
  struct Transfer {
    bool attention = false;
    bool end = false;  // the last byte has END
    GpibDirection direction = GpibDirection::sent;
  };
  // Shows bytes that were transferred at once.
  void show(std::span<const std::uint8_t> bytes, const Transfer& transfer) {
    for (const auto& byte : bytes) {
      const bool isLast = &byte == &bytes.back();
      add(byte, transfer.attention, transfer.end && isLast, transfer.direction);
    }
    flush();
  }
  // Shows all bytes; to be called when the controller begins to wait.
  void flush() {
    if (count_ == 0) return;
    handler_(std::span(bytes_).first(std::exchange(count_, 0)));
  }

 private:
  GpibPeekHandler handler_;
  std::array<GpibPeekedByte, 256> bytes_{};
  std::size_t count_ = 0;
};

}  // namespace mpf
