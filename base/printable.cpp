// SPDX-License-Identifier: MIT
#include "base/printable.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fmt/format.h>
#include <iterator>

namespace mpf {
namespace {

struct Range {
  char32_t first, last;
};

// Control characters beyond ASCII, category Cf of Unicode 15.1, the two separators, and the tags.
constexpr std::array<Range, 20> kUnprintable{
    {{0x80, 0x9f},       {0xad, 0xad},       {0x600, 0x605},     {0x61c, 0x61c},
     {0x6dd, 0x6dd},     {0x70f, 0x70f},     {0x890, 0x891},     {0x8e2, 0x8e2},
     {0x180e, 0x180e},   {0x200b, 0x200f},   {0x2028, 0x202e},   {0x2060, 0x206f},
     {0xfeff, 0xfeff},   {0xfff9, 0xfffb},   {0x110bd, 0x110bd}, {0x110cd, 0x110cd},
     {0x13430, 0x1343f}, {0x1bca0, 0x1bca3}, {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff}}};

// One character of a text, or one byte that is not part of a valid character.
struct Character {
  char32_t code = 0;
  std::size_t bytes = 1;
  bool isValid = false;
};

Character firstOf(std::string_view text) noexcept {
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto lead = at(0);
  if (lead < 0x80) return {lead, 1, true};
  if (lead < 0xc2 || lead > 0xf4) return {lead, 1, false};
  const std::size_t bytes = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  char32_t code = lead & (0x7fu >> bytes);
  if (text.size() < bytes) return {lead, 1, false};
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((at(i) & 0xc0u) != 0x80u) return {lead, 1, false};
    code = code << 6 | (at(i) & 0x3fu);
  }
  const bool isOverlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  const bool isSurrogate = code >= 0xd800 && code <= 0xdfff;
  if (isOverlong || isSurrogate || code > 0x10ffff) return {lead, 1, false};
  return {code, bytes, true};
}

bool isShown(const Character& character) noexcept {
  const auto code = character.code;
  if (!character.isValid || code < ' ' || code == 0x7f) return false;
  return code < 0x80 ||
         std::ranges::none_of(
             kUnprintable,
             [code](const Range& range) { return code >= range.first && code <= range.last; });
}

std::string escaped(const Character& character) {
  if (character.code == '\n') return "\\n";
  if (character.code == '\r') return "\\r";
  if (character.code == '\t') return "\\t";
  const auto code = static_cast<std::uint32_t>(character.code);
  if (!character.isValid || code < 0x80) return fmt::format("\\x{:02x}", code);
  return code < 0x10000 ? fmt::format("\\u{:04x}", code) : fmt::format("\\U{:08x}", code);
}

std::string escapedForJson(const Character& character) {
  const auto code = character.isValid ? static_cast<std::uint32_t>(character.code) : 0xfffdu;
  if (code < 0x10000) return fmt::format("\\u{:04x}", code);
  return fmt::format("\\u{:04x}\\u{:04x}", 0xd7c0u + (code >> 10), 0xdc00u + (code & 0x3ffu));
}

template <class Escape>
std::string replaced(std::string_view text, bool keepsLines, Escape escape) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const auto character = firstOf(text);
    const bool isKept = isShown(character) || (keepsLines && character.code == '\n');
    if (isKept) result.append(text.substr(0, character.bytes));
    else result += escape(character);
    text.remove_prefix(character.bytes);
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) { return replaced(text, false, escaped); }
std::string printableLines(std::string_view text) { return replaced(text, true, escaped); }
std::string printableJson(std::string_view document) {
  return replaced(document, true, escapedForJson);
}

}  // namespace mpf
