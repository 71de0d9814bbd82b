// SPDX-License-Identifier: MIT
// JSON: converts a message to nlohmann::json, for programs that read it.
//
//   {"type": "float64", "clientType": 0, "clientExtra": 0, "timeout": 0, ..., "value": 1.5}
//
// "timeStampNs" is there if the server sent it. Values that JSON cannot express as numbers are
// strings: "nan", "inf", "-inf". A string of bytes has one character for each byte, U+0000 to
// U+00FF; the bytes of a user message are hexadecimal digits. An invalid body, or one of an unknown
// type, has "bytes", its size, in place of fields.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "schema/text.h"
#include "schema/visit.h"

namespace mpf {

namespace detail {

// Converts each byte to one character, in UTF-8.
inline std::string latin1(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) text += c;
    else text += {static_cast<char>(0xc0 | byte >> 6), static_cast<char>(0x80 | (byte & 0x3f))};
  }
  return text;
}

inline nlohmann::json toJson(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(printNumber(value));
}
inline nlohmann::json toJson(std::string_view bytes) { return latin1(bytes); }
inline nlohmann::json toJson(std::span<const char> bytes) {
  return latin1({bytes.data(), bytes.size()});
}
inline nlohmann::json toJson(char c) { return c == '\0' ? std::string() : latin1({&c, 1}); }
inline nlohmann::json toJson(ConnectStatus status) { return toString(status); }
inline nlohmann::json toJson(Fate fate) { return toString(fate); }
inline nlohmann::json toJson(std::int32_t value) { return value; }
inline nlohmann::json toJson(std::uint32_t value) { return value; }
inline nlohmann::json toJson(std::uint64_t value) { return value; }
inline nlohmann::json toJson(std::span<const std::byte> bytes) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string text;
  for (const auto byte : bytes)
    text +=
        {kHex[std::to_integer<unsigned>(byte) / 16], kHex[std::to_integer<unsigned>(byte) % 16]};
  return text;
}
template <class Number>
nlohmann::json toJson(std::span<const Number> numbers) {
  auto list = nlohmann::json::array();
  for (const auto number : numbers) list.push_back(toJson(number));
  return list;
}

}  // namespace detail

[[nodiscard]] inline nlohmann::json toJson(const Message& message) {
  nlohmann::json json{{"type", toString(message.getType())},
                      {"clientType", message.getClientType()},
                      {"clientExtra", message.getClientExtra()}};
  const auto add = [&](std::string_view name, const auto& value) {
    json[std::string(name)] = detail::toJson(value);
  };
  if (message.getTimeStampNs() != 0) json["timeStampNs"] = message.getTimeStampNs();
  const bool ours = visitFields(message, add);
  if (!ours) json["bytes"] = message.body().size();
  return json;
}

}  // namespace mpf
