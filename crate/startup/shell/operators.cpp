// SPDX-License-Identifier: MIT
#include "crate/startup/shell/operators.h"

#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <optional>
#include <utility>

#include "crate/startup/shell/line_error.h"

namespace mpf::startup {
namespace {

using Kind = Value::Kind;

// The operations of unsigned numbers wrap around; those of signed ones would be undefined.
std::int64_t wrapped(std::uint64_t bits) { return static_cast<std::int64_t>(bits); }

std::optional<std::int64_t> integerResult(std::string_view symbol, std::int64_t a, std::int64_t b) {
  const auto x = static_cast<std::uint64_t>(a);
  const auto y = static_cast<std::uint64_t>(b);
  if (symbol == "+") return wrapped(x + y);
  if (symbol == "-") return wrapped(x - y);
  if (symbol == "*") return wrapped(x * y);
  if (symbol == "/") return b == -1 ? wrapped(0 - x) : a / b;
  if (symbol == "%") return b == -1 ? 0 : a % b;
  if (symbol == "&") return wrapped(x & y);
  if (symbol == "|") return wrapped(x | y);
  if (symbol == "^") return wrapped(x ^ y);
  if (symbol == "<<") return wrapped(x << (y & 63));
  if (symbol == ">>") return a >> (y & 63);
  return std::nullopt;
}

std::optional<double> realResult(std::string_view symbol, double a, double b) {
  if (symbol == "+") return a + b;
  if (symbol == "-") return a - b;
  if (symbol == "*") return a * b;
  if (symbol == "/") return a / b;
  return std::nullopt;
}

template <typename T>
std::optional<bool> comparison(std::string_view symbol, T a, T b) {
  if (symbol == "==") return a == b;
  if (symbol == "!=") return a != b;
  if (symbol == "<") return a < b;
  if (symbol == "<=") return a <= b;
  if (symbol == ">") return a > b;
  if (symbol == ">=") return a >= b;
  return std::nullopt;
}

bool isNumber(const Value& value) { return value.is(Kind::integer) || value.is(Kind::real); }

bool isTrue(const Value& value) { return !isNumber(value) || *value.real() != 0; }

// A pointer that is moved. It stays within the memory, as a valid pointer does.
Value moved(const Value& pointer, std::int64_t by, std::size_t column) {
  const auto size = static_cast<std::int64_t>(pointer.memory()->text.size());
  const auto from = static_cast<std::int64_t>(pointer.offset());
  if (by < -from || by > size - from)
    throw LineError{column, "the pointer leaves the string " + pointer.description()};
  return Value::ofMemory(pointer.memory(), static_cast<std::size_t>(from + by));
}

std::optional<Value> pointerResult(std::string_view symbol, const Value& left, const Value& right,
                                   std::size_t column) {
  const bool isSame = left.memory() && left.memory() == right.memory();
  if (symbol == "==" || symbol == "!=") {
    const bool isEqual = isSame && left.offset() == right.offset();
    return Value::ofInteger((symbol == "==") == isEqual ? 1 : 0);
  }
  if (isSame && symbol == "-")
    return Value::ofInteger(static_cast<std::int64_t>(left.offset()) -
                            static_cast<std::int64_t>(right.offset()));
  if (symbol == "+" && left.is(Kind::integer) && right.is(Kind::string))
    return moved(right, *left.integer(), column);
  if (!left.is(Kind::string) || !right.is(Kind::integer)) return std::nullopt;
  if (symbol == "+") return moved(left, *right.integer(), column);
  if (symbol == "-")
    return moved(left, wrapped(0 - static_cast<std::uint64_t>(*right.integer())), column);
  return std::nullopt;
}

void requireDefined(const Value& value, std::size_t column) {
  if (value.is(Kind::undefined))
    throw LineError{column, "undefined symbol " + value.name() + " in an expression"};
}

std::optional<Value> numberResult(std::string_view symbol, const Value& left, const Value& right,
                                  std::size_t column) {
  if (left.is(Kind::integer) && right.is(Kind::integer)) {
    const auto a = *left.integer();
    const auto b = *right.integer();
    if ((symbol == "/" || symbol == "%") && b == 0) throw LineError{column, "division by zero"};
    if (const auto truth = comparison(symbol, a, b)) return Value::ofInteger(*truth ? 1 : 0);
    if (const auto result = integerResult(symbol, a, b)) return Value::ofInteger(*result);
    return std::nullopt;
  }
  const auto a = *left.real();
  const auto b = *right.real();
  if (symbol == "/" && b == 0) throw LineError{column, "division by zero"};
  if (const auto truth = comparison(symbol, a, b)) return Value::ofInteger(*truth ? 1 : 0);
  if (const auto result = realResult(symbol, a, b)) return Value::ofReal(*result);
  return std::nullopt;
}

}  // namespace

int precedenceOf(std::string_view symbol) {
  static constexpr std::array<std::pair<std::string_view, int>, 18> kPrecedences = {{
      {"||", 1},
      {"&&", 2},
      {"|", 3},
      {"^", 4},
      {"&", 5},
      {"==", 6},
      {"!=", 6},
      {"<", 7},
      {"<=", 7},
      {">", 7},
      {">=", 7},
      {"<<", 8},
      {">>", 8},
      {"+", 9},
      {"-", 9},
      {"*", 10},
      {"/", 10},
      {"%", 10},
  }};
  for (const auto& [name, precedence] : kPrecedences)
    if (name == symbol) return precedence;
  return 0;
}

Value applyBinary(std::string_view symbol, const Value& left, const Value& right,
                  std::size_t column) {
  requireDefined(left, column);
  requireDefined(right, column);
  // What was reported already is not reported again.
  if (left.is(Kind::unavailable) || right.is(Kind::unavailable)) return Value::unavailable();
  if (symbol == "&&") return Value::ofInteger(isTrue(left) && isTrue(right) ? 1 : 0);
  if (symbol == "||") return Value::ofInteger(isTrue(left) || isTrue(right) ? 1 : 0);
  const auto result = isNumber(left) && isNumber(right)
                          ? numberResult(symbol, left, right, column)
                          : pointerResult(symbol, left, right, column);
  if (result) return *result;
  throw LineError{column, fmt::format("the operator {} cannot be applied to {} and {}", symbol,
                                      left.description(), right.description())};
}

Value applyUnary(std::string_view symbol, const Value& operand, std::size_t column) {
  requireDefined(operand, column);
  if (operand.is(Kind::unavailable)) return operand;
  if (symbol == "!") return Value::ofInteger(isTrue(operand) ? 0 : 1);
  if (symbol == "+" && isNumber(operand)) return operand;
  if (symbol == "-" && operand.is(Kind::real)) return Value::ofReal(-*operand.real());
  if (const auto integer = operand.integer()) {
    const auto bits = static_cast<std::uint64_t>(*integer);
    if (symbol == "-") return Value::ofInteger(wrapped(0 - bits));
    if (symbol == "~") return Value::ofInteger(wrapped(~bits));
  }
  if (symbol == "*" && operand.is(Kind::string)) {
    const auto text = *operand.text();
    return Value::ofInteger(text.empty() ? 0 : text.front());
  }
  throw LineError{column, fmt::format("the operator {} cannot be applied to {}", symbol,
                                      operand.description())};
}

}  // namespace mpf::startup
