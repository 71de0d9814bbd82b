// SPDX-License-Identifier: MIT
#include "tools/text/wrap.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>

namespace mpf::tools {
namespace {

// Whether a byte is one after the first of a UTF-8 character.
bool isContinuation(char c) noexcept { return (static_cast<unsigned char>(c) & 0xc0u) == 0x80u; }

// The width of stdout, of which a process has one.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
std::size_t columnsInUse = kColumns;

}  // namespace

std::size_t lineColumns() noexcept { return columnsInUse; }

void fitToTerminal() noexcept {
  constexpr std::size_t kLeast = 40;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return;
  columnsInUse = std::max<std::size_t>(size.ws_col, kLeast);
}

// fmt pads by columns, and a text never has more columns than bytes: "°" has one column and two
// bytes, "電" has two columns and three bytes.
std::size_t columnsOf(const std::string& text) {
  return 2 * text.size() - fmt::formatted_size("{:<{}}", text, text.size());
}

std::string wrap(const std::string& first, const std::string& text, std::size_t indent) {
  std::string lines;
  std::string line = first;
  bool isFresh = true;  // the line consists of its indent only
  const auto next = [&] {
    lines += line + '\n';
    line.assign(indent, ' ');
    isFresh = true;
  };
  constexpr const char* kBlanks = " \t\n\r\v\f";
  for (std::size_t at = 0; at < text.size();) {
    const auto begin = std::min(text.find_first_not_of(kBlanks, at), text.size());
    if (begin == text.size()) break;
    const auto blanks = begin - at;  // kept, because a name may contain several in a row
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
