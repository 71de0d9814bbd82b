// SPDX-License-Identifier: MIT
#include "crate/startup/shell/string_functions.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fmt/format.h>
#include <string>
#include <utility>

#include "crate/startup/shell/line_error.h"
#include "crate/startup/shell/string_argument.h"

namespace mpf::startup {
namespace {

using Kind = Value::Kind;
using Limits = StartupShell::Limits;

[[noreturn]] void refuse(const Command& command, std::size_t index, const std::string& expected) {
  throw LineError{columnOf(command, index),
                  fmt::format("{}: expected {}, found {}", command.name, expected,
                              command.argument(index).description())};
}

Value allocate(const Command& command) {
  auto bytes = command.argument(0).integer();
  if (!bytes || *bytes < 0) refuse(command, 0, "a number of bytes");
  auto memory = std::make_shared<StringMemory>();
  memory->capacity = static_cast<std::uint64_t>(*bytes);
  if (command.name == "calloc") {
    const auto each = command.argument(1).integer();
    if (!each || *each < 0) refuse(command, 1, "a number of bytes");
    memory->capacity *= static_cast<std::uint64_t>(*each);
  }
  return Value::ofMemory(std::move(memory));
}

Value release(const Command& command, LineActions& actions) {
  const auto value = command.argument(0);
  if (value.integer() == 0) return {};  // free(NULL) is valid
  if (!value.is(Kind::string)) refuse(command, 0, "a result of malloc()");
  if (std::exchange(value.memory()->isFreed, true))
    actions.report(Severity::warning, columnOf(command, 0), "this memory is already free");
  return {};
}

// Replaces what follows `at` in the memory of the first argument.
Value write(const Command& command, std::size_t at, const std::string& text, ShellState& state,
            LineActions& actions) {
  const auto target = command.argument(0);
  auto& memory = *target.memory();
  const auto column = columnOf(command, 0);
  const auto length = at + text.size();
  state.stringBytes += text.size();
  if (length > Limits::kStringBytes || state.stringBytes > Limits::kAllStringBytes)
    throw LineError{column, fmt::format("{}: the string is too long", command.name)};
  if (memory.isFreed)
    actions.report(Severity::warning, column, command.name + " writes into memory that is free");
  if (length + 1 > memory.capacity)
    actions.report(Severity::warning, column,
                   fmt::format("{} writes {} bytes into {}: allocate more", command.name,
                               length + 1, memory.capacity));
  memory.text.resize(std::min(at, memory.text.size()));
  memory.text += text;
  return target;
}

// One conversion of sprintf(), such as %5.2f. `at` is behind the %; moved behind the conversion.
std::string converted(const std::string& format, std::size_t& at, const Command& command,
                      std::size_t& index) {
  constexpr std::string_view kModifiers = "-+ #0123456789.lh";
  std::string specification = "%";
  for (; at < format.size() && kModifiers.find(format[at]) != std::string_view::npos; ++at)
    if (format[at] != 'l' && format[at] != 'h') specification += format[at];
  const char type = at < format.size() ? format[at++] : '\0';
  if (type == '%') return "%";
  if (specification.size() > 8)
    throw LineError{columnOf(command, 1), "sprintf: a conversion is too wide"};
  const auto value = command.argument(index);
  std::array<char, 512> buffer{};
  const auto print = [&](const std::string& form, auto number) {
    const int length = std::snprintf(buffer.data(), buffer.size(), form.c_str(), number);
    return std::string(buffer.data(),
                       std::min(static_cast<std::size_t>(length), buffer.size() - 1));
  };
  if (type == 's') return textOf(command, index++);
  if (std::string_view("diuxXoc").find(type) != std::string_view::npos && type != '\0') {
    const auto integer = value.integer();
    if (!integer) refuse(command, index, "an integer");
    ++index;
    if (type == 'c') return {static_cast<char>(*integer)};
    return print(specification + "ll" + type, static_cast<long long>(*integer));
  }
  if (std::string_view("feEgG").find(type) != std::string_view::npos && type != '\0') {
    const auto real = value.real();
    if (!real) refuse(command, index, "a number");
    ++index;
    return print(specification + type, *real);
  }
  throw LineError{columnOf(command, 1), "sprintf: a conversion that is not supported"};
}

std::string formatted(const Command& command) {
  const auto format = textOf(command, 1);
  std::string result;
  std::size_t index = 2;
  for (std::size_t at = 0; at < format.size();) {
    if (format[at] == '%') result += converted(format, ++at, command, index);
    else result += format[at++];
    if (result.size() > Limits::kStringBytes)
      throw LineError{columnOf(command, 1), "sprintf: the string is too long"};
  }
  return result;
}

}  // namespace

std::optional<Value> tryStringFunction(const Command& command, ShellState& state,
                                       LineActions& actions) {
  const auto& name = command.name;
  if (name == "malloc" || name == "calloc") return allocate(command);
  if (name == "free") return release(command, actions);
  if (name == "strlen")
    return Value::ofInteger(static_cast<std::int64_t>(textOf(command, 0).size()));
  if (name != "strcpy" && name != "strcat" && name != "sprintf") return std::nullopt;
  const auto target = command.argument(0);
  if (!target.is(Kind::string)) refuse(command, 0, "a string or a result of malloc()");
  const auto end = std::max(target.offset(), target.memory()->text.size());
  const auto at = name == "strcat" ? end : target.offset();
  return write(command, at, name == "sprintf" ? formatted(command) : textOf(command, 1), state,
               actions);
}

}  // namespace mpf::startup
