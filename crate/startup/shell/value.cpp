// SPDX-License-Identifier: MIT
#include "crate/startup/shell/value.h"

#include <algorithm>
#include <fmt/format.h>

#include "base/number.h"

namespace mpf::startup {
namespace {

// All of the word as an integer: decimal, 0x or 0 in front as in C.
std::optional<std::int64_t> wholeInteger(const std::string& word) {
  const bool isNegative = word.starts_with('-');
  const std::size_t sign = isNegative || word.starts_with('+') ? 1 : 0;
  int base = 10;
  std::size_t begin = sign;
  if (word.size() > sign + 1 && word[sign] == '0') {
    const bool isHex = word[sign + 1] == 'x' || word[sign + 1] == 'X';
    base = isHex ? 16 : 8;
    begin = sign + (isHex ? 2 : 1);
  }
  const auto magnitude = tryNumber<std::uint64_t>(std::string_view(word).substr(begin), base);
  if (!magnitude) return std::nullopt;
  return static_cast<std::int64_t>(isNegative ? 0 - *magnitude : *magnitude);
}

std::optional<double> wholeReal(const std::string& word) {
  // "nan" and "inf" are names.
  if (word.find_first_of("0123456789") == std::string::npos) return std::nullopt;
  return tryNumber<double>(std::string_view(word).substr(word.starts_with('+') ? 1 : 0));
}

}  // namespace

Value Value::ofInteger(std::int64_t integer) {
  Value value;
  value.integer_ = integer;
  return value;
}

Value Value::ofReal(double real) {
  Value value;
  value.kind_ = Kind::real;
  value.real_ = real;
  return value;
}

Value Value::ofString(std::string text) {
  auto memory = std::make_shared<StringMemory>();
  memory->capacity = text.size() + 1;
  memory->text = std::move(text);
  return ofMemory(std::move(memory));
}

Value Value::ofMemory(std::shared_ptr<StringMemory> memory, std::size_t offset) {
  Value value;
  value.kind_ = Kind::string;
  value.memory_ = std::move(memory);
  value.offset_ = offset;
  return value;
}

Value Value::ofAddress(std::string name) {
  Value value;
  value.kind_ = Kind::address;
  value.name_ = std::move(name);
  return value;
}

Value Value::ofOpaque(std::any handle) {
  Value value;
  value.kind_ = Kind::opaque;
  value.opaque_ = std::move(handle);
  return value;
}

Value Value::undefined(std::string name) {
  Value value;
  value.kind_ = Kind::undefined;
  value.name_ = std::move(name);
  return value;
}

Value Value::unavailable() {
  Value value;
  value.kind_ = Kind::unavailable;
  return value;
}

Value Value::ofWord(std::string word) {
  Value value;
  if (const auto integer = wholeInteger(word)) value = ofInteger(*integer);
  else if (const auto real = wholeReal(word)) value = ofReal(*real);
  else return ofString(std::move(word));
  value.word_ = std::move(word);
  return value;
}

std::optional<std::int64_t> Value::integer() const {
  return kind_ == Kind::integer ? std::optional(integer_) : std::nullopt;
}

std::optional<double> Value::real() const {
  if (kind_ == Kind::integer) return static_cast<double>(integer_);
  return kind_ == Kind::real ? std::optional(real_) : std::nullopt;
}

std::optional<std::string> Value::text() const {
  if (kind_ != Kind::string) return word_;
  return memory_->text.substr(std::min(offset_, memory_->text.size()));
}

std::string Value::description() const {
  switch (kind_) {
    case Kind::integer:
      return word_.value_or(std::to_string(integer_));
    case Kind::real:
      return word_.value_or(fmt::format("{}", real_));
    case Kind::string:
      return '"' + *text() + '"';
    case Kind::address:
      return '&' + name_;
    case Kind::opaque:
      return "the result of a command";
    case Kind::undefined:
      return "undefined symbol " + name_;
    case Kind::unavailable:
      return "the result of a command that was not executed";
  }
  return {};
}

}  // namespace mpf::startup
