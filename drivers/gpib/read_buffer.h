// SPDX-License-Identifier: MIT
// ReadBuffer: what one instrument has sent and no read has returned yet. For controllers that
// cannot stop an instrument where a read ends.
//
//   append("1.5;2.5\n", END) ──► "1.5;2.5\n" ──► take({.endOfString = ';'}) = "1.5;"
//                                "2.5\n"     ──► take({.endOfString = ';'}) = "2.5\n", END
//
// Threads  one at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf {

class ReadBuffer {
 public:
  // Adds bytes that were received; `end`: the last of them came with END.
  void append(std::span<const std::uint8_t> bytes, bool end);
  // Removes the bytes up to the first of `limits` or END. Empty: none of them is in the buffer.
  [[nodiscard]] std::optional<GpibReadResult> take(const GpibReadLimits& limits);
  // Removes all bytes, for a read that ended early.
  [[nodiscard]] std::vector<std::uint8_t> takeAll();

 private:
  std::vector<std::uint8_t> bytes_;
  bool end_ = false;  // the last byte came with END
};

}  // namespace mpf
