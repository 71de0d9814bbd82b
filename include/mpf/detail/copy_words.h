// SPDX-License-Identifier: MIT
// copyWords, copyField: copies of what has just been written, through registers.
//
// Internal: installed because <mpf/message.h> uses them, as the rings in shared memory do. Programs
// must not: any release may change or remove them.
//
//   copyWords<32>(to, from);            // bytes, in words of 32 bits
//   copyField(to.length, from.length);  // one field, at its own width
//
// A message is copied right after its fields were written one by one. A memcpy of constant length
// uses loads that are as wide as the processor has; such a load cannot be served from several
// narrower stores that are still in the store buffer, so it waits for them: about 5 ns a message.
//
// Threads  as memcpy: `to` belongs to the caller.
// Trust    `from` may be shared memory that a peer overwrites: the copy then has any contents.
// Throws   nothing; allocates nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace mpf::detail {

// Copies `bytes` bytes, a multiple of 4. Any alignment; `to` and `from` must not overlap.
template <std::size_t bytes>
inline void copyWords(std::byte* to, const std::byte* from) noexcept {
  static_assert(bytes % sizeof(std::uint32_t) == 0);
  for (std::size_t at = 0; at < bytes; at += sizeof(std::uint32_t)) {
    std::uint32_t word = 0;
    std::memcpy(&word, from + at, sizeof word);
    // Keeps the compiler from merging the words into wider loads.
    asm("" : "+r"(word));
    std::memcpy(to + at, &word, sizeof word);
  }
}

// The same for one field, which must fit into a register: an integer, enum, bool or pointer.
template <class Field>
inline void copyField(Field& to, const Field& from) noexcept {
  Field field = from;
  asm("" : "+r"(field));
  to = field;
}

}  // namespace mpf::detail
