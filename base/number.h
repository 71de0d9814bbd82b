// SPDX-License-Identifier: MIT
// Numbers in text, without blanks and without a `+`. Integers have a base, and no prefix such as
// 0x.
#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace mpf {

// Takes a number from the front of `text`. Returns nullopt, and does not change `text`, if there is
// none or if Number cannot hold it.
template <class Number>
std::optional<Number> tryTakeNumber(std::string_view& text, int base = 10) noexcept {
  const auto* const begin = text.data();
  const auto* const end = begin + text.size();
  Number number{};
  std::from_chars_result result{};
  if constexpr (std::is_integral_v<Number>) result = std::from_chars(begin, end, number, base);
  else result = std::from_chars(begin, end, number);
  if (result.ec != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(result.ptr - begin));
  return number;
}

// All of `text` as a number.
template <class Number>
std::optional<Number> tryNumber(std::string_view text, int base = 10) noexcept {
  const auto number = tryTakeNumber<Number>(text, base);
  return text.empty() ? number : std::nullopt;
}

}  // namespace mpf
