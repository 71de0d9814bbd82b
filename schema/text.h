// SPDX-License-Identifier: MIT
// Text: prints a message as one line, and creates a message from words that a person types.
//
//   int32Array timeout=0 cmd=2 status=0 address=3 extra=0 value=1,2,3
//   char8Array timeout=1 ... eomLen=2 eomString="\r\n" value="*IDN?"
//
// Bytes are written as C strings, with \xHH of exactly two digits; those of a user message as
// hexadecimal digits. tryParse() reads everything that print() has written in full (a NaN loses its
// payload).
//
// Threads  any number of callers at a time.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <mpf/message.h>

namespace mpf {

// Prints a message as one line. An array of more than maxElements ends in ",... (5000)"; an invalid
// body is reported as such. clientType and clientExtra are shown unless they are 0.
[[nodiscard]] std::string print(const Message& message, std::size_t maxElements = 16);

// Returns the type with this name; nullopt for an unknown name.
[[nodiscard]] std::optional<MessageType> tryParseType(std::string_view name) noexcept;

// The names of all types for messages to the user: "connect, int32, int32Array, ...".
[[nodiscard]] std::string typeNames();

// Creates a message from words of the form `field=value`; other fields are 0, arrays empty.
//
//   words     integers are decimal, or hexadecimal bit patterns (0xffffffff is -1 in 32 bits);
//             numbers as for strtod; statuses by name; characters plain or escaped; arrays as
//             `value=1,2,3`; strings C-escaped, with or without quotes; eomString also sets eomLen
//   error     "int32: no field 'adress'; there are timeout, cmd, status, address, extra, value,
//             clientType, clientExtra"
//   returns   nullopt with `error` set
[[nodiscard]] std::optional<Message> tryParse(MessageType type, std::span<const std::string> words,
                                              std::string& error);

// C-escapes bytes, without quotes: "\r\n", "\x00".
[[nodiscard]] std::string escape(std::string_view bytes);
// The inverse of escape(); nullopt for an unknown escape sequence.
[[nodiscard]] std::optional<std::string> tryUnescape(std::string_view text);

// Returns the shortest text that reads back as the same number; nan, inf, -inf.
[[nodiscard]] std::string printNumber(double value);

}  // namespace mpf
