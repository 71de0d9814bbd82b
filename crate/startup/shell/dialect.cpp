// SPDX-License-Identifier: MIT
#include "crate/startup/shell/dialect.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

namespace mpf::startup {
namespace {

bool isNameCharacter(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  return begin == std::string_view::npos ? std::string_view() : text.substr(begin);
}

// Removes the texts of strings, whose contents are no sign.
std::string withoutStrings(std::string_view line) {
  std::string result;
  bool isInString = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\' && isInString) ++i;
    else if (line[i] == '"') isInString = !isInString;
    else if (!isInString) result += line[i];
  }
  return result;
}

bool isVxWorks(std::string_view name, std::string_view rest, std::string_view line) {
  static constexpr std::array<std::string_view, 6> kNames = {"malloc", "calloc", "free",
                                                             "strcpy", "strcat", "sprintf"};
  if (line.find("/*") != std::string_view::npos) return true;
  if (name.empty()) return false;
  return (rest.starts_with('=') && !rest.starts_with("==")) || rest.starts_with('<') ||
         std::ranges::find(kNames, name) != kNames.end();
}

bool isIocsh(std::string_view name, std::string_view rest, std::string_view line) {
  if (line.starts_with('<')) return trimmed(line.substr(1)).starts_with("envPaths");
  if (name == "var" && !rest.starts_with('=')) return true;
  if (name == "epicsEnvSet" && !rest.empty() && rest.find(',') == std::string_view::npos &&
      std::isalpha(static_cast<unsigned char>(rest.front())))
    return true;
  return line.find("$(") != std::string_view::npos || line.find("${") != std::string_view::npos;
}

}  // namespace

Dialect detectDialect(std::string_view content, Dialect otherwise) {
  if (content.starts_with("#!")) return Dialect::iocsh;
  int signs = 0;  // of iocsh, less those of vxWorks
  while (!content.empty()) {
    const auto end = std::min(content.find('\n'), content.size());
    const auto text = withoutStrings(content.substr(0, end));
    content.remove_prefix(std::min(end + 1, content.size()));
    const auto line = trimmed(text);
    if (line.empty() || line.front() == '#') continue;
    const auto length =
        static_cast<std::size_t>(std::ranges::find_if_not(line, isNameCharacter) - line.begin());
    const auto name = line.substr(0, length);
    const auto rest = trimmed(line.substr(length));
    if (isVxWorks(name, rest, line)) --signs;
    if (isIocsh(name, rest, line)) ++signs;
  }
  return signs == 0 ? otherwise : signs > 0 ? Dialect::iocsh : Dialect::vxWorks;
}

}  // namespace mpf::startup
