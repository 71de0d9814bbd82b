// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/parameter_text.h"

#include <cctype>
#include <charconv>
#include <fmt/format.h>

namespace mpf {
namespace {

bool isBlank(char character) noexcept {
  return std::isspace(static_cast<unsigned char>(character)) != 0;
}
bool isLetter(char character) noexcept {
  return std::isalpha(static_cast<unsigned char>(character)) != 0;
}
bool isDigit(char character) noexcept { return character >= '0' && character <= '9'; }
bool hasPrefix(std::string_view text) noexcept {
  return text.starts_with("0x") || text.starts_with("0X");
}

// "0x6000" in base 16, "128" in base 10.
std::string inBase(std::uint32_t value, int base) {
  return base == 16 ? fmt::format("0x{:x}", value) : fmt::format("{}", value);
}

std::string allowed(const ParameterLimits& limits, int base) {
  std::string text = limits.multipleOf == 1
                         ? ""
                         : fmt::format("a multiple of {}, ", inBase(limits.multipleOf, base));
  return text + fmt::format("{} to {}", inBase(limits.least, base), inBase(limits.most, base));
}

}  // namespace

char ParameterText::peek() noexcept {
  while (!rest_.empty() && isBlank(rest_.front())) rest_.remove_prefix(1);
  return rest_.empty() ? '\0' : rest_.front();
}

char ParameterText::take() noexcept {
  const auto character = rest_.front();
  rest_.remove_prefix(1);
  return character;
}

bool ParameterText::trySkip(char character) noexcept {
  if (peek() != character) return false;
  rest_.remove_prefix(1);
  return true;
}

void ParameterText::expect(char character, std::string_view after) {
  if (!trySkip(character))
    refuse(fmt::format("expected '{}' after the {}, found \"{}\"", character, after, rest_));
}

void ParameterText::expectEnd() {
  if (!atEnd()) refuse(fmt::format("unexpected \"{}\" at the end", rest_));
}

bool ParameterText::trySkipBeforeNumber(char separator) noexcept {
  const auto before = rest_;
  if (trySkip(separator) && isDigit(peek())) return true;
  rest_ = before;
  return false;
}

std::string_view ParameterText::word() noexcept {
  static_cast<void>(peek());
  std::size_t length = 0;
  while (length < rest_.size() && isLetter(rest_[length])) ++length;
  const auto word = rest_.substr(0, length);
  rest_.remove_prefix(length);
  return word;
}

std::uint32_t ParameterText::hex(std::string_view what, const ParameterLimits& limits) {
  static_cast<void>(peek());
  if (hasPrefix(rest_)) rest_.remove_prefix(2);
  return digits(what, 16, limits);
}

std::uint32_t ParameterText::number(std::string_view what, const ParameterLimits& limits) {
  static_cast<void>(peek());
  if (hasPrefix(rest_)) return hex(what, limits);
  return digits(what, 10, limits);
}

int ParameterText::level(std::string_view what) {
  const auto level = number(what);
  if (level > 7)
    refuse(fmt::format("{} {}: use 1 to 7, or 0 for no interrupt", what, level),
           IndustryPackStatus::badIntLevel);
  return static_cast<int>(level);
}

void ParameterText::refuse(const std::string& problem, IndustryPackStatus status) const {
  throw IndustryPackError(status, fmt::format("{} \"{}\": {}", board_, whole_, problem));
}

std::uint32_t ParameterText::digits(std::string_view what, int base,
                                    const ParameterLimits& limits) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value, base);
  if (error == std::errc::invalid_argument)
    refuse(rest_.empty() ? fmt::format("the {} is missing", what)
                         : fmt::format("the {} is not a number: \"{}\"", what, rest_));
  if (error != std::errc() || value % limits.multipleOf != 0 || value < limits.least ||
      value > limits.most) {
    const auto length = static_cast<std::size_t>(end - rest_.data());
    const auto text =
        error != std::errc() ? std::string(rest_.substr(0, length)) : inBase(value, base);
    refuse(fmt::format("{} {}: use {}", what, text, allowed(limits, base)));
  }
  rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
  return value;
}

}  // namespace mpf
