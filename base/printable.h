// SPDX-License-Identifier: MIT
// printable(): makes text of another process or host safe to show on a terminal, in a log and in a
// report. Only this file decides which characters are shown unchanged.
//
//   "dac\x1b[2J"      ->  dac\x1b[2J        the terminal does not execute the escape sequence
//   "a<U+202E>b"      ->  a\u202eb          the text does not change its direction
//   "a\xffb"          ->  a\xffb            the byte that is not UTF-8 is visible
//   "Süd <U+1F525>"   ->  unchanged
//
// Threads  any.
// Trust    accepts any bytes; the result is valid UTF-8 without control or format characters.
#pragma once

#include <string>
#include <string_view>

namespace mpf {

// Returns `text` with each control character (C0, DEL, C1), format character (Unicode category Cf:
// bidirectional controls, zero-width characters, tags), line or paragraph separator (U+2028,
// U+2029) and each byte that is not part of valid UTF-8 replaced by a C escape: \n, \r, \t, \xHH
// for a byte, \uHHHH or \UHHHHHHHH for a code point. A backslash is not escaped.
[[nodiscard]] std::string printable(std::string_view text);

// As printable(), for text of several lines: keeps each '\n'.
[[nodiscard]] std::string printableLines(std::string_view text);

// As printable(), for a JSON document: keeps each '\n' and writes the other characters as JSON
// escapes, such as \u202e, so that the document keeps its meaning. In a valid document these
// characters occur only inside strings.
[[nodiscard]] std::string printableJson(std::string_view document);

}  // namespace mpf
