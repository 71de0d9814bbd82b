// SPDX-License-Identifier: MIT
// Handling: the request that a server works on, as one word of its window, so that others can say
// why it does nothing else.
//
//   bit 63: 1 | 48..62: 0 | 32..47: type of the message | 0..31: its cmd         the word 0: it
//   works on none
//
// Since when: WindowControl::progressAtNs, which is no later than the request was taken.
//
// Threads  the server's stores it; any may read it.
// Trust    a reader takes it for a text and nothing else.
#pragma once

#include <cstdint>
#include <optional>

#include "shm/layout.h"

namespace mpf {

struct Handling {
  static constexpr std::uint16_t kSinceMinor = 1;

  std::uint16_t type = 0;
  std::int32_t cmd = 0;  // 0 of types without one

  [[nodiscard]] constexpr std::uint64_t word() const noexcept {
    return kIsSet | std::uint64_t{type} << 32 | static_cast<std::uint32_t>(cmd);
  }
  [[nodiscard]] static constexpr std::optional<Handling> of(std::uint64_t word) noexcept {
    if ((word & kIsSet) == 0) return std::nullopt;
    return Handling{static_cast<std::uint16_t>(word >> 32),
                    static_cast<std::int32_t>(static_cast<std::uint32_t>(word))};
  }

 private:
  static constexpr std::uint64_t kIsSet = std::uint64_t{1} << 63;
};

}  // namespace mpf
