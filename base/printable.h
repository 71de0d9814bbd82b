// SPDX-License-Identifier: MIT
// printable(): makes text that another process or host wrote safe to show on a terminal, in a log
// and in a report. The only place that decides which characters are shown as they are.
//
//   "dac\x1b[2J"      ->  dac\x1b[2J        the escape sequence is text, no command to the terminal
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
// for a byte, \uHHHH or \UHHHHHHHH for a code point. A backslash stays as it is.
[[nodiscard]] std::string printable(std::string_view text);

// The same for text of several lines: keeps each '\n'.
[[nodiscard]] std::string printableLines(std::string_view text);

// The same for a JSON document: keeps each '\n' and writes the others as JSON does, \u202e, so that
// the document keeps its meaning. Those stand only inside strings of a document.
[[nodiscard]] std::string printableJson(std::string_view document);

}  // namespace mpf
