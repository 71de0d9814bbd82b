// SPDX-License-Identifier: MIT
// Text: a message as one line that a person reads, and words that a person types as a message.
//
//   int32Array timeout=0 cmd=2 status=0 address=3 extra=0 value=1,2,3
//   char8Array timeout=1 ... eomLen=2 eomString="\r\n" value="*IDN?"
//
// Bytes are written as C strings, with \xHH of exactly two digits; those of a user message as hexadecimal digits. What print() wrote in
// full, tryParse() reads back (a NaN loses its payload).
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <mpf/schema/message.h>

namespace mpf {

// One line. An array of more than maxElements ends in ",... (5000)"; a body that is none says so. clientType and clientExtra are shown
// unless 0.
[[nodiscard]] std::string print(const Message& message, std::size_t maxElements = 16);

// The type of that name; nullopt for a name that is none.
[[nodiscard]] std::optional<MessageType> tryParseType(std::string_view name) noexcept;

// "connect, int32, int32Array, ..." for messages to the user.
[[nodiscard]] std::string typeNames();

// Makes a message from words `field=value`; fields not named are 0, arrays empty.
//
//   words     integers decimal, or hexadecimal as bits: 0xffffffff is -1 of 32 bits; numbers as strtod; statuses by name; characters as
//             themselves or escaped; `value=1,2,3`; strings C-escaped, quotes around them optional; eomString sets eomLen too
//   error     "int32: no field 'adress'; there are timeout, cmd, status, address, extra, value, clientType, clientExtra"
//   returns   nullopt with `error` set
[[nodiscard]] std::optional<Message> tryParse(MessageType type, std::span<const std::string> words, std::string& error);

// C-escapes bytes, without quotes: "\r\n", "\x00".
[[nodiscard]] std::string escape(std::string_view bytes);
// The inverse; nullopt for a backslash that starts nothing known.
[[nodiscard]] std::optional<std::string> tryUnescape(std::string_view text);

// The shortest text that reads back as the same number; nan, inf, -inf.
[[nodiscard]] std::string printNumber(double value);

}  // namespace mpf
