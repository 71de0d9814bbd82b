// SPDX-License-Identifier: MIT
// StringParameters: the parameters of a "stringParm" record, from its INP or OUT link.
//
//   #C<location> S<index> @<server>,TERM=0d0a,IX=3,FMT=V%.2f,TO=500,N=10,0STR=off,1STR=on
//
// A parameter may be anywhere in the text: its key is the first place with these characters, inside
// another word too. FMT, 0STR and 1STR end at the next comma. Text instead of a number is 0.
//
// Source  the EPICS module ip, README.devXxStrParm.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mpf {

struct StringParameters {
  // TERM: up to nine bytes as hexadecimal pairs, until the first other character; "TERM=ok>" and
  // "TERM=" are no terminator. Appended to output, removed from answers.
  std::string terminator = "\r\n";
  // IX: the first character that is converted or sent.
  std::size_t index = 0;
  std::chrono::milliseconds timeout{0};  // TO
  std::int32_t maxBytes = 100;  // N: the answer ends after so many bytes
  std::optional<std::string> format;  // FMT
  std::string zero, one;  // 0STR, 1STR: an answer that begins so is 0 or 1

  //   index    the signal of the link: IX unless given
  //   timeout  TO unless given
  //   throws   std::invalid_argument for a negative IX
  static StringParameters parse(std::string_view text, int index,
                                std::chrono::milliseconds timeout);

  // The answer without its terminator, from `index` on, until a zero byte.
  //   returns  nullopt when the answer has no character at `index`
  [[nodiscard]] std::optional<std::string> textOf(std::string_view answer) const;
};

}  // namespace mpf
