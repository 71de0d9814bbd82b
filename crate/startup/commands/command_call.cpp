// SPDX-License-Identifier: MIT
#include "crate/startup/commands/command_call.h"

#include <filesystem>
#include <fmt/format.h>
#include <utility>

#include "shm/link.h"

namespace mpf::startup {

std::string CommandCall::text(std::size_t index, std::string_view what) {
  const auto value = command_.argument(index);
  auto text = value.text();
  if (!text || text->empty() || !has(index)) {
    refuseType(index, what, "a string");
    return {};
  }
  return *std::move(text);
}

std::string CommandCall::name(std::size_t index, std::string_view what) {
  auto name = text(index, what);
  if (name.find(',') != std::string::npos)
    refuse(index, fmt::format("{} \"{}\" contains a comma, which separates arguments of programs; "
                              "choose another name",
                              what, name));
  return name;
}

std::string CommandCall::textOr(std::size_t index, std::string_view what, std::string otherwise) {
  const auto value = command_.argument(index);
  if (auto text = value.text()) return *std::move(text);
  if (!has(index) || value.integer() == 0) return otherwise;
  refuseType(index, what, "a string");
  return otherwise;
}

std::int64_t CommandCall::integer(std::size_t index, std::string_view what, std::int64_t least,
                                  std::int64_t most) {
  const auto number = command_.argument(index).integer();
  if (!number) {
    refuseType(index, what, "an integer");
    return least;
  }
  if (*number < least || *number > most) {
    refuse(index,
           fmt::format("{} is {}; it must be between {} and {}", what, *number, least, most));
    return least;
  }
  return *number;
}

std::int64_t CommandCall::queueSize(std::size_t index) {
  return integer(index, "queueSize", 0, LinkGeometry::kMaxQueueSize);
}

char CommandCall::letter(std::size_t index, std::string_view what, std::string_view allowed,
                         char otherwise) {
  const auto value = command_.argument(index);
  auto letter = otherwise;
  if (const auto text = value.text(); text && !text->empty()) letter = text->front();
  else if (const auto number = value.integer()) letter = *number == 0 ? otherwise : char(*number);
  else refuseType(index, what, "a letter");
  if (allowed.find(letter) == std::string_view::npos) {
    refuse(index, fmt::format("{} is {}; write one of the letters {}", what, value.description(),
                              allowed));
    return otherwise;
  }
  return letter;
}

void CommandCall::refuse(std::size_t index, const std::string& text) {
  isValid_ = false;
  if (!refused_.insert(index).second) return;
  shell_.reportArgument(Severity::error, command_, index,
                        fmt::format("{}: {}", command_.name, text));
}

void CommandCall::refuseType(std::size_t index, std::string_view what, std::string_view expected) {
  const auto value = command_.argument(index);
  if (value.is(Value::Kind::unavailable)) {
    isValid_ = false;  // reported where it became so
  } else if (!has(index)) {
    refuse(index, fmt::format("argument {}, {}, is missing", index + 1, what));
  } else if (value.is(Value::Kind::undefined)) {
    refuse(index, fmt::format("undefined symbol {} as {}: assign {} to it before this line",
                              value.name(), what, expected));
  } else {
    refuse(index, fmt::format("{} is {}; {} is expected", what, value.description(), expected));
  }
}

std::string CommandCall::source() const {
  const auto file = std::filesystem::path(command_.place.file).filename().string();
  const auto begin = command_.text.find_first_not_of(" \t");
  return fmt::format("{}:{}: {}", file, command_.place.line,
                     begin == std::string::npos ? "" : command_.text.substr(begin));
}

}  // namespace mpf::startup
