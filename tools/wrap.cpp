// SPDX-License-Identifier: MIT
#include <mpf/tools/wrap.h>

#include <fmt/format.h>
#include <sstream>

namespace mpf::tools {
namespace {

// Of a character in UTF-8, a byte after the first.
bool isContinuation(char c) noexcept { return (static_cast<unsigned char>(c) & 0xc0u) == 0x80u; }

}  // namespace

// fmt pads by columns, never more than a text's bytes: "°" is one of two bytes, "電" two of three.
std::size_t columnsOf(const std::string& text) { return 2 * text.size() - fmt::formatted_size("{:<{}}", text, text.size()); }

std::string wrap(const std::string& first, const std::string& text, std::size_t indent) {
  std::string lines;
  std::string line = first;
  bool isFresh = true;  // nothing but the indent is in the line
  const auto next = [&] {
    lines += line + '\n';
    line.assign(indent, ' ');
    isFresh = true;
  };
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!isFresh && columnsOf(line) + 1 + columnsOf(word) > kColumns) next();
    if (!isFresh) line += ' ';
    while (columnsOf(line) + columnsOf(word) > kColumns) {
      auto room = kColumns - columnsOf(line);
      while (room > 1 && isContinuation(word[room])) --room;
      line += word.substr(0, room);
      word.erase(0, room);
      next();
    }
    line += word;
    isFresh = false;
  }
  return lines + line + '\n';
}

std::string counted(std::uint64_t count, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", count, count == 1 ? one : many.empty() ? one + "s" : many);
}

std::string cut(const std::string& text, std::size_t columns) {
  if (columnsOf(text) <= columns) return text;
  auto shorter = text;
  while (columnsOf(shorter) >= columns) {
    while (isContinuation(shorter.back())) shorter.pop_back();
    shorter.pop_back();
  }
  return shorter + "~";
}

}  // namespace mpf::tools
