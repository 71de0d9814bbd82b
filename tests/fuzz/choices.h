// SPDX-License-Identifier: MIT
// Choices: a fuzzer's input as a run of choices; zeros, and what stands behind its end, choose the
// usual.
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
  // 0 to end - 1.
  std::uint64_t below(std::uint64_t end) noexcept {
    return take(end <= 256 ? 1 : end <= 65536 ? 2 : 8) % end;
  }
  bool oneIn(std::uint64_t n) noexcept { return below(n) == n - 1; }
  std::uint64_t bits() noexcept { return take(8); }
  // Numbers of all magnitudes.
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
