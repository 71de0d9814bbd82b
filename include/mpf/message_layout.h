// SPDX-License-Identifier: MIT
// Message layout: the sizes and the names of message types by their numbers, derived from the
// descriptions in <mpf/message_types.h>.
//
//   const mpf::BodyLayout& layout = mpf::layoutOf(message.getType());
//   // an array: layout.headerBytes + length * layout.elementBytes
//
// Threads  constants.
// Throws   nothing in this header throws or allocates.
// Trust    every number is accepted: one that has no type has sizes 0 and the name "unknown".
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <mpf/message_types.h>

namespace mpf {

// The sizes that are needed to check a body. All are 0 for MessageType::none and unknown types.
struct BodyLayout {
  std::uint32_t headerBytes = 0;  // size of the struct
  std::uint32_t elementBytes = 0;  // size of an element; 0 for a scalar
  std::uint32_t lengthOffset = 0;  // of the field `length` in the struct
  std::string_view name = "none";
};

namespace detail {

template <class T>
constexpr BodyLayout layoutOf() {
  static_assert(std::is_standard_layout_v<T> && std::is_trivially_copyable_v<T> && alignof(T) <= 8);
  static_assert(std::has_unique_object_representations_v<T> || std::is_same_v<T, Float64>,
                "a struct with padding sends uninitialised bytes to a peer");
  if constexpr (ArrayBody<T>) {
    static_assert(sizeof(T) % 8 == 0, "elements are aligned to 8 bytes");
    static_assert(std::has_single_bit(sizeof(typename T::Element)), "lengths come from a shift");
    return {sizeof(T), sizeof(typename T::Element), offsetof(T, length), T::kName};
  } else {
    return {sizeof(T), 0, 0, T::kName};
  }
}

template <class... T>
constexpr auto layoutsOf(std::type_identity<std::tuple<T...>> /*types*/) {
  std::array<BodyLayout, sizeof...(T) + 1> layouts{};
  ((layouts[static_cast<std::size_t>(T::kType)] = layoutOf<T>()), ...);
  return layouts;
}
inline constexpr auto kLayouts = layoutsOf(std::type_identity<MessageTypes>{});
inline constexpr BodyLayout kUnknownLayout{.name = "unknown"};

}  // namespace detail

// The layout of a type; one with sizes 0 and the name "unknown" for a number that has no type.
[[nodiscard]] constexpr const BodyLayout& layoutOf(MessageType type) noexcept {
  const auto at = static_cast<std::size_t>(type);
  return at < detail::kLayouts.size() ? detail::kLayouts[at] : detail::kUnknownLayout;
}

// The name of a type, as in texts and JSON; "unknown" for a type that only newer programs have.
// Valid until the process exits.
[[nodiscard]] constexpr std::string_view toString(MessageType type) noexcept {
  return layoutOf(type).name;
}

}  // namespace mpf
