// SPDX-License-Identifier: MIT
// tryAnswerBits(): the commands cmdReadBits and cmdReadBits16 of include/mpf/digital_io_commands.h,
// for all servers of digital lines.
#pragma once

#include <cstdint>

#include <mpf/digital_io_commands.h>
#include <mpf/message_types.h>

namespace mpf {

[[nodiscard]] inline bool isReadRequest(std::int32_t cmd) noexcept {
  return cmd == digital::cmdReadBits || cmd == digital::cmdReadBits16;
}

// Sets the value of the request to the bits that it requests. Returns false when `extra` is
// invalid.
[[nodiscard]] inline bool tryAnswerBits(Int32& request, std::int32_t cmd,
                                        std::uint32_t bits) noexcept {
  const auto mask = static_cast<std::uint32_t>(request.address);
  const auto lowest = request.extra;
  if (cmd == digital::cmdReadBits) {
    request.value = static_cast<std::int32_t>(bits & mask);
    return true;
  }
  if (lowest < 0 || lowest > 16) return false;
  request.value = static_cast<std::int32_t>((bits >> lowest) & mask & 0xffff);
  return true;
}

}  // namespace mpf
