// SPDX-License-Identifier: MIT
// ReadyBits: takes the ready bits that peers set in the hints of our window, in turn.
//
//   readyWords   bit w is set: word w of readyBits may have set bits
//   readyBits    | word 0: links 0 to 63 | word 1: links 64 to 127 | ...
//
// Threads  one owner thread; peers set bits at any time (PeerWindow::notify()).
// Trust    peers may set and clear every bit: a bit only says that a link may have an event.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>

#include "shm/cache_line.h"
#include "shm/layout.h"

namespace mpf {

class ReadyBits {
 public:
  explicit ReadyBits(layout::WindowHints& hints) noexcept : hints_(hints) {}

  // Sets the bit of link `index`, as its peer does, but without waking the owner.
  void set(std::uint32_t index) noexcept;
  [[nodiscard]] bool hasAny() const noexcept {
    const auto& words = hints_.readyWords;
    return std::any_of(words.begin(), words.end(),
                       [](const auto& word) { return word.load(std::memory_order_relaxed) != 0; });
  }
  // Clears a set bit and returns its index, if `isLink(index)` is true. Begins at position(), so
  // that low indices do not starve high ones. Takes at most two bits of each word, because faulty
  // peers may set bits without end; nullopt if none of them belongs to a link.
  template <class IsLink>
  std::optional<std::uint32_t> tryTake(const IsLink& isLink) noexcept {
    const auto first = position_ / 64;
    const auto rest = kAllBits << (position_ % 64);
    for (auto word = nextWord(first); word < kWords; word = nextWord(word + 1)) {
      const auto index = tryTakeFrom(word, word == first ? rest : kAllBits);
      if (index && isLink(*index)) return index;
    }
    for (auto word = nextWord(0); word <= first; word = nextWord(word + 1)) {
      const auto index = tryTakeFrom(word, kAllBits);
      if (index && isLink(*index)) return index;
    }
    return std::nullopt;
  }
  // Fetches the lines that the next tryTake() probably needs.
  void expectTake() const noexcept {
    const auto word = position_ / 64;
    lines::request(&hints_.readyWords[word / 64]);
    lines::request(&hints_.readyBits[word]);
  }
  // The index after the one that was taken last.
  [[nodiscard]] std::uint32_t position() const noexcept { return position_; }

 private:
  static constexpr std::uint32_t kWords = layout::kMaxLinks / 64;
  static constexpr auto kAllBits = ~std::uint64_t{0};

  // The first word, from `from` on, that may have set bits; kWords if there is no such word.
  [[nodiscard]] std::uint32_t nextWord(std::uint32_t from) const noexcept {
    for (auto group = from / 64; group < hints_.readyWords.size(); ++group) {
      auto words = hints_.readyWords[group].load(std::memory_order_relaxed);
      if (group == from / 64) words &= kAllBits << (from % 64);
      if (words != 0) return group * 64 + static_cast<std::uint32_t>(std::countr_zero(words));
    }
    return kWords;
  }
  // Takes one of the `eligible` bits of a word.
  std::optional<std::uint32_t> tryTakeFrom(std::uint32_t word, std::uint64_t eligible) noexcept;

  layout::WindowHints& hints_;
  std::uint32_t position_ = 0;
};

}  // namespace mpf
