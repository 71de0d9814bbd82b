// SPDX-License-Identifier: MIT
// copyWords, copyField, alone, joined: copies of what has just been written, through registers.
//
// Internal: installed because <mpf/message.h> uses them, as the rings in shared memory do. Programs
// must not: any release may change or remove them.
//
//   copyWords<32>(to, from);            // bytes, read in words of 32 bits
//   copyField(to.length, from.length);  // one field, at its own width
//   alone(from.type);                   // a number that is not loaded with its neighbour
//   joined(first, second);              // two neighbours in memory as one number
//
// A message is copied right after its fields were written one by one. A memcpy of constant length
// uses loads that are as wide as the processor has; such a load cannot be served from several
// narrower stores that are still in the store buffer, so it waits for them: about 5 ns a message.
// Stores are as wide as possible, because their number limits the rate of small messages: see
// docs/decisions/0031-few-stores.md.
//
// Threads  as memcpy: `to` belongs to the caller.
// Trust    `from` may be shared memory that a peer overwrites: the copy then has any contents.
// Throws   nothing; allocates nothing.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <mpf/detail/cpp20.h>

namespace mpf::detail {

// The same value, which the compiler must have in a register of its own: it may not load two
// neighbours at once. An integer, enum, bool or pointer.
template <class Value>
[[nodiscard]] inline Value alone(Value value) noexcept {
  asm("" : "+r"(value));
  return value;
}
// The same number with 64 bits, in a register. Otherwise the compiler may save 32 bits on the stack
// and load 64, since a shift drops the rest.
[[nodiscard]] inline std::uint64_t widened(std::uint32_t number) noexcept {
  return alone(std::uint64_t{number});
}
// The number of 64 bits whose memory is that of `first`, then that of `second`.
[[nodiscard]] inline std::uint64_t joined(std::uint32_t first, std::uint32_t second) noexcept {
  const bool isLittle = std::endian::native == std::endian::little;
  return isLittle ? widened(first) | widened(second) << 32 : widened(first) << 32 | widened(second);
}
// The two numbers of joined().
[[nodiscard]] constexpr std::uint32_t firstOf(std::uint64_t both) noexcept {
  return static_cast<std::uint32_t>(std::endian::native == std::endian::little ? both : both >> 32);
}
[[nodiscard]] constexpr std::uint32_t secondOf(std::uint64_t both) noexcept {
  return static_cast<std::uint32_t>(std::endian::native == std::endian::little ? both >> 32 : both);
}
// The number of 32 bits whose memory is that of the three numbers, one after the other.
[[nodiscard]] inline std::uint32_t joined(std::uint16_t first, std::uint8_t second,
                                          std::uint8_t third) noexcept {
  const bool isLittle = std::endian::native == std::endian::little;
  // The first two come from a message or are constants; a flag may have been saved on the stack.
  const auto last = static_cast<std::uint32_t>(widened(third));
  return isLittle ? first | std::uint32_t{second} << 16 | last << 24
                  : std::uint32_t{first} << 16 | std::uint32_t{second} << 8 | last;
}

// Copies 8 bytes: reads two words of 32 bits and writes one of 64.
[[gnu::always_inline]] inline void copyWord(std::byte* to, const std::byte* from) noexcept {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  std::memcpy(&first, from, sizeof first);
  std::memcpy(&second, from + sizeof first, sizeof second);
  const auto both = joined(first, second);
  std::memcpy(to, &both, sizeof both);
}
// Copies `bytes` bytes, a multiple of 8. Any alignment; `to` and `from` must not overlap.
template <std::size_t bytes>
[[gnu::always_inline]] inline void copyWords(std::byte* to, const std::byte* from) noexcept {
  static_assert(bytes != 0 && bytes % 8 == 0);
  copyWord(to, from);
  if constexpr (bytes > 8) copyWords<bytes - 8>(to + 8, from + 8);
}
// The same for one field, as for alone().
template <class Field>
inline void copyField(Field& to, const Field& from) noexcept {
  to = alone(from);
}

}  // namespace mpf::detail
