// SPDX-License-Identifier: MIT
// MaybeIndex: the index of a link, or nothing, in one word. Used like std::optional, whose two
// members the compiler stores one by one and loads together: on the path of each message, that load
// waits for the stores.
#pragma once

#include <cstdint>

namespace mpf {

class MaybeIndex {
 public:
  constexpr MaybeIndex() noexcept = default;
  // NOLINTNEXTLINE(google-explicit-constructor): as std::optional
  constexpr MaybeIndex(std::uint32_t index) noexcept : index_(index) {}

  constexpr explicit operator bool() const noexcept { return index_ != kNothing; }
  constexpr std::uint32_t operator*() const noexcept { return index_; }
  friend constexpr bool operator==(MaybeIndex, MaybeIndex) noexcept = default;

 private:
  static constexpr std::uint32_t kNothing = ~std::uint32_t{0};  // links have lower indices
  std::uint32_t index_ = kNothing;
};

}  // namespace mpf
