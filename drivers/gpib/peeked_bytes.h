// SPDX-License-Identifier: MIT
// showPeeked: passes bytes that a controller has transferred to its peek handler.
//
// Threads  any; calls the handler.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf {

struct PeekedTransfer {
  GpibDirection direction = GpibDirection::sent;
  bool attention = false;  // commands
  bool end = false;  // the last byte came with END
};

// Does nothing when `handler` or `bytes` is empty.
inline void showPeeked(const GpibPeekHandler& handler, std::span<const std::uint8_t> bytes,
                       const PeekedTransfer& transfer) {
  if (!handler || bytes.empty()) return;
  const auto now = Clock::nowNs();
  std::vector<GpibPeekedByte> peeked;
  peeked.reserve(bytes.size());
  for (const auto value : bytes) {
    peeked.push_back({.atNs = now,
                      .value = value,
                      .attention = transfer.attention,
                      .direction = transfer.direction});
  }
  peeked.back().endOrIdentify = transfer.end;
  handler(peeked);
}

}  // namespace mpf
