// SPDX-License-Identifier: MIT
// MessageValue: the value of a message or of a record field, converted between both.
//
//   reply ── readingOf() ──► MessageValue ── convertTo(), toText(), storeElements() ──► field
//   field ── loadElements() ─► MessageValue ── makeMessage() ──► request
//
// A conversion that would change the value does not happen: NaN and infinities are no integers, and
// numbers outside the range of the target do not fit, nor integers that no double can hold exactly.
// Fractions are rounded to the nearest integer, and doubles to the nearest float.
// Text converts to the number that it begins with; numbers convert to text. The first element of an
// array stands for it where one value is needed.
//
// Threads  plain data and functions without state.
// Trust    a peer may write to a message in shared memory while it is read: each element is read
//          once, and what is stored is what was checked.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <mpf/message_of.h>

#include "epics/general/link_options.h"

namespace mpf {

// Refers to the message or field that it was read from.
using MessageValue = std::variant<std::int64_t, double, std::string_view,
                                  std::span<const std::int32_t>, std::span<const double>>;

struct Reading {
  std::int32_t status;
  MessageValue value;
};

// The status and the value of a message; nullopt for a type without a value.
[[nodiscard]] std::optional<Reading> readingOf(const Message& message);

// A request with the fields of the link and a value; nullopt when the value does not fit the type.
[[nodiscard]] std::optional<Message> makeMessage(const LinkOptions& options, std::int32_t cmd,
                                                 const MessageValue& value);
// A request that reads or subscribes.
[[nodiscard]] std::optional<Message> makeQuery(const LinkOptions& options, std::int32_t cmd);

// The number as a To; nullopt when it does not fit.
template <class To, class From>
[[nodiscard]] std::optional<To> fit(From number) noexcept {
  if constexpr (std::is_floating_point_v<To>) {
    if constexpr (std::is_integral_v<From>)
      if (fit<From>(static_cast<double>(number)) != number) return std::nullopt;
    const auto result = static_cast<To>(number);
    if (std::isinf(result) && !std::isinf(static_cast<double>(number))) return std::nullopt;
    return result;
  } else if constexpr (std::is_floating_point_v<From>) {
    const double rounded = std::round(static_cast<double>(number));
    // The first number above the range is a power of two, which a double can hold.
    const double end = std::ldexp(1, std::numeric_limits<To>::digits);
    if (!(rounded >= static_cast<double>(std::numeric_limits<To>::min()) && rounded < end))
      return std::nullopt;
    return static_cast<To>(rounded);
  } else {
    if (!std::in_range<To>(number)) return std::nullopt;
    return static_cast<To>(number);
  }
}

// One number; nullopt for text that is no number, an empty array, and numbers that do not fit.
[[nodiscard]] std::optional<std::int64_t> toInteger(const MessageValue& value);
[[nodiscard]] std::optional<double> toDouble(const MessageValue& value);
template <class To>
[[nodiscard]] std::optional<To> convertTo(const MessageValue& value) {
  if constexpr (std::is_floating_point_v<To>) {
    return toDouble(value);
  } else {
    const auto number = toInteger(value);
    return number ? fit<To>(*number) : std::nullopt;
  }
}
// 32 bits: of a signed or an unsigned number.
[[nodiscard]] std::optional<std::uint32_t> toBits(const MessageValue& value);
// Text up to its first zero byte; nullopt for an empty array of numbers.
[[nodiscard]] std::optional<std::string> toText(const MessageValue& value);

// How a value was stored in a record.
enum class Stored {
  done,
  converted,  // in VAL of an ai record, which must not convert RVAL
  truncated,
  doesNotFit,  // the field has its value from before
};

// Arrays of records, whose element type is a menuFtype. Text has one element for each byte.
//   array   room for `room` elements
//   used    out: number of elements
[[nodiscard]] Stored storeElements(const MessageValue& value, int elementType, void* array,
                                   std::uint32_t room, std::uint32_t& used);
//   scratch   holds the elements that have no type in messages
//   returns   nullopt when an element does not fit a double
[[nodiscard]] std::optional<MessageValue> loadElements(int elementType, const void* array,
                                                       std::uint32_t used,
                                                       std::vector<double>& scratch);
// The type of message that holds arrays of these elements; none for strings.
[[nodiscard]] MessageType messageTypeOf(int elementType) noexcept;

}  // namespace mpf
