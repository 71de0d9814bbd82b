// SPDX-License-Identifier: MIT
#include "crate/startup/shell/diagnostics.h"

#include <algorithm>
#include <fmt/format.h>

#include "base/printable.h"

namespace mpf::startup {
namespace {

constexpr std::size_t kExcerptBytes = 100;

const char* nameOf(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      return "error";
  }
  return "";
}

// The part of the line around the column, and a caret below it.
std::string excerpt(const std::string& line, std::size_t column) {
  if (column == 0) return "\n  " + printable(line.substr(0, kExcerptBytes));
  const auto at = std::min(column - 1, line.size());
  const auto begin = at < kExcerptBytes ? 0 : at - kExcerptBytes / 2;
  auto before = printable(line.substr(begin, at - begin));
  const auto after = printable(line.substr(at, kExcerptBytes - (at - begin)));
  // A byte of UTF-8 that continues a character takes no column of the terminal.
  const auto width = std::ranges::count_if(before, [](char c) { return (c & 0xC0) != 0x80; });
  return fmt::format("\n  {}{}\n  {}^", before, after,
                     std::string(static_cast<std::size_t>(width), ' '));
}

}  // namespace

std::string Place::text() const {
  auto text = printable(file);
  if (line > 0) text += fmt::format(":{}", line);
  if (column > 0) text += fmt::format(":{}", column);
  return text;
}

std::string Diagnostic::formatted() const {
  std::string result;
  for (const auto& include : includedFrom)
    result += fmt::format("in a file that {} includes:\n", include.text());
  result += fmt::format("{}: {}: {}", place.text(), nameOf(severity), printable(text));
  if (!line.empty()) result += excerpt(line, place.column);
  return result;
}

void Diagnostics::add(Diagnostic diagnostic) {
  ++counts_[static_cast<std::size_t>(diagnostic.severity)];
  if (all_.size() < kMaxKept) all_.push_back(std::move(diagnostic));
}

std::size_t Diagnostics::count(Severity severity) const noexcept {
  return counts_[static_cast<std::size_t>(severity)];
}

}  // namespace mpf::startup
