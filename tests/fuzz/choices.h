// SPDX-License-Identifier: MIT
// Choices: the input of a fuzzer as a sequence of choices. Zero bytes, and the bytes after the end
// of the input, choose the usual case.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <span>

namespace mpf::test {

class Choices {
 public:
  explicit Choices(std::span<const std::uint8_t> input) noexcept : input_(input) {}

  [[nodiscard]] bool isOver() const noexcept { return input_.empty(); }
  // A number from 0 to end - 1.
  std::uint64_t below(std::uint64_t end) noexcept {
    return take(end <= 256 ? 1 : end <= 65536 ? 2 : 8) % end;
  }
  bool oneIn(std::uint64_t n) noexcept { return below(n) == n - 1; }
  std::uint64_t bits() noexcept { return take(8); }
  // A number of any magnitude, often next to a power of two.
  std::uint64_t nasty() noexcept {
    const auto byte = take(1);
    const auto power = std::uint64_t{1} << byte % 64;
    return byte < 192 ? power - 1 + byte / 64 : take(8);
  }

 private:
  std::uint64_t take(int bytes) noexcept {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes && !input_.empty(); ++i, input_ = input_.subspan(1))
      value = value << 8 | input_.front();
    return value;
  }
  std::span<const std::uint8_t> input_;
};

}  // namespace mpf::test
