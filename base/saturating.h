// SPDX-License-Identifier: MIT
// Sums and differences of times [ns] that come from files or from memory that others write. Where
// the result does not fit into 64 bits, it is the least or the greatest number.
#pragma once

#include <cstdint>
#include <limits>

namespace mpf {

[[nodiscard]] constexpr std::int64_t saturatingSum(std::int64_t a, std::int64_t b) noexcept {
  using Limits = std::numeric_limits<std::int64_t>;
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return a < 0 ? Limits::min() : Limits::max();
}

[[nodiscard]] constexpr std::int64_t saturatingDifference(std::int64_t a, std::int64_t b) noexcept {
  using Limits = std::numeric_limits<std::int64_t>;
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return a < 0 ? Limits::min() : Limits::max();
}

}  // namespace mpf
