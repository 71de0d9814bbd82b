// SPDX-License-Identifier: MIT
#include "crate/startup/commands/ioc_file.h"

#include <algorithm>
#include <fmt/format.h>

namespace mpf::startup {

std::string problemOfArgument(std::string_view text) {
  if (std::ranges::any_of(text,
                          [](unsigned char c) { return (c < ' ' && c != '\t') || c == 0x7f; }))
    return "contains a control character, such as the end of a line, which the command of an IOC "
           "cannot contain; remove it";
  if (text.find('"') != std::string_view::npos && text.find('\'') != std::string_view::npos)
    return "contains both kinds of quotes, which the command of an IOC cannot contain; use one of "
           "them";
  return {};
}

// Inside quotes, iocsh takes each character as it is.
std::string iocshQuoted(std::string_view text) {
  const char quote = text.find('"') == std::string_view::npos ? '"' : '\'';
  return quote + std::string(text) + quote;
}

void IocFile::add(const std::string& command, const std::vector<std::string>& arguments,
                  const std::string& source) {
  text_ += fmt::format("# {}\n{}", source, command);
  if (!arguments.empty()) {
    text_ += '(';
    for (std::size_t i = 0; i < arguments.size(); ++i)
      text_ += (i == 0 ? "" : ", ") + iocshQuoted(arguments[i]);
    text_ += ')';
  }
  text_ += '\n';
  isNeeded_ = isNeeded_ || command == "iocInit" || command.starts_with("dbLoad");
}

}  // namespace mpf::startup
