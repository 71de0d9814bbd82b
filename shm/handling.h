// SPDX-License-Identifier: MIT
// Handling: the request that a server works on, as one word of its window, so that tools can show
// why the server does not take other requests.
//
//   bit 63   1; the word 0 means that the server works on no request
//   48..62   0
//   32..47   type of the message
//   0..31    cmd of the message
//
// WindowControl::progressAtNs is a time not later than the start of this work.
//
// Threads  the server's thread stores the word; any thread of any process may read it.
// Trust    a reader uses it for texts only.
#pragma once

#include <cstdint>
#include <optional>

#include "shm/layout.h"

namespace mpf {

struct Handling {
  std::uint16_t type = 0;
  std::int32_t cmd = 0;  // 0 for message types without a cmd field

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
