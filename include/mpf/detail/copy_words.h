// SPDX-License-Identifier: MIT
// copyWords, copyField: copies of what has just been written, through registers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace mpf {

// A memcpy of constant length uses loads as wide as they come, and these wait for the narrow stores
// that have just written the fields (store forwarding): some 5 ns a message.
template <std::size_t bytes>
inline void copyWords(std::byte* to, const std::byte* from) noexcept {
  static_assert(bytes % sizeof(std::uint32_t) == 0);
  for (std::size_t at = 0; at < bytes; at += sizeof(std::uint32_t)) {
    std::uint32_t word = 0;
    std::memcpy(&word, from + at, sizeof word);
    asm("" : "+r"(word));
    std::memcpy(to + at, &word, sizeof word);
  }
}

// The same for one field, at its own width.
template <class Field>
inline void copyField(Field& to, const Field& from) noexcept {
  Field field = from;
  asm("" : "+r"(field));
  to = field;
}

}  // namespace mpf
