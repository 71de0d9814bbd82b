// SPDX-License-Identifier: MIT
// Defines "every byte written and read", for all peers and for the floors.
#pragma once

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

// Reads every byte, at the speed of the memory: g++ keeps sums of this type in registers; an array
// of integers it would store and load again for each sum.
inline std::uint64_t readAll(const void* from, std::size_t bytes) noexcept {
  using Words = std::uint64_t __attribute__((vector_size(16)));
  const auto* at = static_cast<const std::byte*>(from);
  const auto next = [&at] {
    Words words;
    std::memcpy(&words, at, sizeof words);
    at += sizeof words;
    return words;
  };
  Words first{}, second{}, third{}, fourth{};
  for (; bytes >= 4 * sizeof(Words); bytes -= 4 * sizeof(Words)) {
    first += next();
    second += next();
    third += next();
    fourth += next();
  }
  const Words sums = first + second + third + fourth;
  std::uint64_t sum = sums[0] + sums[1];
  for (; bytes > 0; --bytes, ++at) sum += static_cast<std::uint64_t>(*at);
  asm volatile("" : : "r"(sum));  // keeps the compiler from removing the reads
  return sum;
}

}  // namespace mpf::bench
