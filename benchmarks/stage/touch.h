// SPDX-License-Identifier: MIT
// Defines "every byte written and read", for all peers and for the floors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace mpf::bench {

// Writes every byte. `to` may be null if `bytes` is 0.
inline void writeAll(void* to, std::size_t bytes) noexcept {
  if (bytes == 0) return;
  static std::uint8_t value = 0;
  std::memset(to, ++value, bytes);
}

// Reads every byte. Independent sums avoid waits for anything but the memory.
inline std::uint64_t readAll(const void* from, std::size_t bytes) noexcept {
  constexpr std::size_t kLanes = 8;
  const auto* at = static_cast<const std::byte*>(from);
  std::array<std::uint64_t, kLanes> sums{};
  for (; bytes >= sizeof sums; bytes -= sizeof sums, at += sizeof sums) {
    std::array<std::uint64_t, kLanes> words;
    std::memcpy(words.data(), at, sizeof words);
    for (std::size_t lane = 0; lane < kLanes; ++lane) sums[lane] += words[lane];
  }
  std::uint64_t sum = 0;
  for (; bytes > 0; --bytes, ++at) sum += static_cast<std::uint64_t>(*at);
  for (const auto lane : sums) sum += lane;
  asm volatile("" : : "r"(sum));  // keeps the compiler from removing the reads
  return sum;
}

}  // namespace mpf::bench
