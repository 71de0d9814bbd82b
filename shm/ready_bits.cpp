// SPDX-License-Identifier: MIT
#include "shm/ready_bits.h"

#include <bit>

#include "base/step.h"

namespace mpf {

void ReadyBits::set(std::uint32_t index) noexcept {
  const auto word = index / 64;
  hints_.readyBits[word].fetch_or(std::uint64_t{1} << (index % 64), std::memory_order_relaxed);
  // PAIR(ready-word): set after the ready bit.
  hints_.readyWords[word / 64].fetch_or(std::uint64_t{1} << (word % 64), std::memory_order_release);
}

std::optional<std::uint32_t> ReadyBits::tryTakeFrom(std::uint32_t word,
                                                    std::uint64_t eligible) noexcept {
  auto bits = hints_.readyBits[word].load(std::memory_order_relaxed);
  if (bits != 0 && (bits & eligible) == 0) return std::nullopt;
  auto& words = hints_.readyWords[word / 64];
  const auto wordBit = std::uint64_t{1} << (word % 64);
  // PAIR(ready-word): cleared before the ready bits are read. A peer that sets a ready bit later
  // sets this bit again.
  words.fetch_and(~wordBit, std::memory_order_acq_rel);
  MPF_STEP(ready_word_taken);
  bits = hints_.readyBits[word].load(std::memory_order_relaxed);
  std::optional<std::uint32_t> index;
  if ((bits & eligible) != 0) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits & eligible));
    const auto others = ~(std::uint64_t{1} << bit);
    // PAIR(ready-bit): cleared before the caller looks at the link.
    bits = hints_.readyBits[word].fetch_and(others, std::memory_order_acq_rel) & others;
    MPF_STEP(ready_bit_taken);
    index = word * 64 + bit;
    position_ = (*index + 1) % layout::kMaxLinks;
  }
  // PAIR(ready-word): set again, because other bits of this word are still set.
  if (bits != 0) words.fetch_or(wordBit, std::memory_order_release);
  return index;
}

}  // namespace mpf
