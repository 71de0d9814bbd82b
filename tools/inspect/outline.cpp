// SPDX-License-Identifier: MIT
#include "tools/inspect/outline.h"

#include <algorithm>
#include <fmt/format.h>

#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

std::string words(std::string key) {
  std::ranges::replace(key, '_', ' ');
  return key;
}

std::string valueText(const Tree& value) {
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

bool isFlat(const Tree& tree) {
  return std::ranges::all_of(
      tree, [](const Tree& value) { return value.is_primitive() && !value.is_null(); });
}

// "pid 1, user 0" of an object, "1 2 3" of an array.
std::string flatText(const Tree& tree) {
  std::string text;
  for (const auto& [key, value] : tree.items()) {
    if (value.is_string() && value.get_ref<const std::string&>().empty()) continue;
    text +=
        tree.is_array() ? (text.empty() ? "" : " ") : (text.empty() ? "" : ", ") + words(key) + " ";
    text += valueText(value);
  }
  return text.empty() ? "none" : text;
}

std::string line(std::size_t indent, const std::string& key, const std::string& text) {
  return wrap(std::string(indent, ' '), words(key) + ": " + text, indent + 2);
}

// "   1748  waiting  #17 int32 ..."
std::string messageText(const Tree& message, std::size_t indent) {
  auto text = fmt::format("#{} ", message.at("request_id").get<std::uint32_t>());
  if (message.contains("chunk")) text += "(in a chunk: " + flatText(message.at("chunk")) + ") ";
  text += message.contains("problem") ? "unreadable: " + message.at("problem").get<std::string>()
                                      : message.at("text").get<std::string>();
  const auto first =
      fmt::format("{:{}}{:>8} {:<11} ", "", indent, message.at("position").get<std::uint64_t>(),
                  message.at("state").get<std::string>());
  auto lines = wrap(first, text, first.size());
  if (message.contains("raw")) lines += hexDump(message.at("raw").get<std::string>(), indent);
  return lines;
}

}  // namespace

std::string hexDump(const std::string& digits, std::size_t indent) {
  constexpr std::size_t kDigits = 32;  // digits in a line
  std::string text;
  std::string before;
  bool isSkipping = false;
  for (std::size_t at = 0; at < digits.size(); at += kDigits) {
    const auto row = digits.substr(at, kDigits);
    if (row == before && at + kDigits < digits.size()) {
      if (!isSkipping) text += std::string(indent, ' ') + "*\n";
      isSkipping = true;
      continue;
    }
    isSkipping = false;
    before = row;
    std::string bytes;
    std::string characters;
    for (std::size_t i = 0; i + 1 < row.size(); i += 2) {
      const auto byte = static_cast<char>(std::stoi(row.substr(i, 2), nullptr, 16));
      bytes += " " + row.substr(i, 2);
      characters += byte >= ' ' && byte <= '~' ? byte : '.';
    }
    text += fmt::format("{:{}}{:04x} {:<48}  {}\n", "", indent, at / 2, bytes, characters);
  }
  return text;
}

std::string outline(const Tree& tree, std::size_t indent) {
  std::string text;
  for (const auto& [key, value] : tree.items()) {
    const bool isList = value.is_array() && !isFlat(value);
    if (key == "raw") {
      text += std::string(indent, ' ') + "raw:\n" + hexDump(value.get<std::string>(), indent + 2);
    } else if (value.is_primitive()) {
      text += line(indent, key, valueText(value));
    } else if (isFlat(value)) {
      text += line(indent, key, flatText(value));
    } else if (isList && key == "messages") {
      text += std::string(indent, ' ') + "messages:\n";
      for (const auto& message : value) text += messageText(message, indent);
    } else if (isList) {
      for (const auto& entry : value) text += line(indent, key, flatText(entry));
    } else {
      text += std::string(indent, ' ') + words(key) + ":\n" + outline(value, indent + 2);
    }
  }
  return text;
}

}  // namespace mpf::tools
