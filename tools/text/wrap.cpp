// SPDX-License-Identifier: MIT
#include "tools/text/wrap.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>

namespace mpf::tools {
namespace {

// Of a character in UTF-8, a byte after the first.
bool isContinuation(char c) noexcept { return (static_cast<unsigned char>(c) & 0xc0u) == 0x80u; }

std::size_t columnsInUse =
    kColumns;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables): of this process's one stdout

}  // namespace

std::size_t lineColumns() noexcept { return columnsInUse; }

void fitToTerminal() noexcept {
  constexpr std::size_t kLeast = 40;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return;
  columnsInUse = std::max<std::size_t>(size.ws_col, kLeast);
}

// fmt pads by columns, never more than a text's bytes: "°" is one of two bytes, "電" two of three.
std::size_t columnsOf(const std::string& text) {
  return 2 * text.size() - fmt::formatted_size("{:<{}}", text, text.size());
}

std::string wrap(const std::string& first, const std::string& text, std::size_t indent) {
  std::string lines;
  std::string line = first;
  bool isFresh = true;  // nothing but the indent is in the line
  const auto next = [&] {
    lines += line + '\n';
    line.assign(indent, ' ');
    isFresh = true;
  };
  constexpr const char* kBlanks = " \t\n\r\v\f";
  for (std::size_t at = 0; at < text.size();) {
    const auto begin = std::min(text.find_first_not_of(kBlanks, at), text.size());
    if (begin == text.size()) break;
    const auto blanks = begin - at;  // a name may have several
    at = std::min(text.find_first_of(kBlanks, begin), text.size());
    auto word = text.substr(begin, at - begin);
    if (!isFresh && columnsOf(line) + blanks + columnsOf(word) > lineColumns()) next();
    if (!isFresh) line.append(blanks, ' ');
    while (columnsOf(line) + columnsOf(word) > lineColumns()) {
      auto room = lineColumns() - columnsOf(line);
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
