// SPDX-License-Identifier: MIT
#include "crate/startup/shell/vxworks_line.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <utility>

#include "crate/startup/shell/operators.h"

namespace mpf::startup {
namespace {

using TokenKind = Token::Kind;

bool isAssignment(const Token& token) {
  static constexpr std::string_view kCompound = "+-*/%&|^";
  if (token.kind != TokenKind::symbol || !token.text.ends_with('=')) return false;
  const auto& text = token.text;
  return text == "=" || text == "<<=" || text == ">>=" ||
         (text.size() == 2 && kCompound.find(text.front()) != std::string_view::npos);
}

// Counts the depth of an expression while it exists.
class Nesting {
 public:
  Nesting(std::size_t& depth, std::size_t column) : depth_(depth) {
    if (++depth_ <= StartupShell::Limits::kNesting) return;
    --depth_;
    throw LineError{column, fmt::format("the expression is nested more than {} deep",
                                        StartupShell::Limits::kNesting)};
  }
  ~Nesting() { --depth_; }
  Nesting(const Nesting&) = delete;
  Nesting& operator=(const Nesting&) = delete;

 private:
  std::size_t& depth_;
};

// The value of `(type)value`. Pointer types change nothing.
Value converted(const Value& value, bool isReal) {
  if (isReal) return value.real() ? Value::ofReal(*value.real()) : value;
  if (!value.is(Value::Kind::real)) return value;
  constexpr double kLimit = 9.2e18;  // within an int64_t
  return Value::ofInteger(static_cast<std::int64_t>(std::clamp(*value.real(), -kLimit, kLimit)));
}

}  // namespace

void VxWorksLine::failAtToken(const std::string& expected) {
  const auto& token = lexer_.token();
  std::string found = token.text;
  if (token.kind == TokenKind::end) found = "the end of the line";
  else if (token.kind == TokenKind::string) found = '"' + token.text + '"';
  else if (token.kind != TokenKind::name && token.kind != TokenKind::symbol) found = "a number";
  throw LineError{token.column, fmt::format("expected {}, found {}", expected, found)};
}

void VxWorksLine::expect(std::string_view symbol) {
  if (!lexer_.token().isSymbol(symbol)) failAtToken(std::string(symbol));
  lexer_.advance();
}

void VxWorksLine::execute() {
  if (lexer_.token().isSymbol("<")) {
    const auto column = lexer_.token().column;
    const auto file = lexer_.readFileName();
    if (file.empty()) throw LineError{column, "the name of a file is expected after <"};
    if (!isAtEnd()) failAtToken("the end of the line");
    return actions_.include(file, column);
  }
  while (lexer_.token().kind != TokenKind::end) {
    if (!lexer_.token().isSymbol(";")) statement();
    if (!isAtEnd()) failAtToken("an operator, a comma or the end of the line");
    if (lexer_.token().isSymbol(";")) lexer_.advance();
  }
}

Value VxWorksLine::statement() {
  const Nesting nesting(nesting_, lexer_.token().column);
  if (lexer_.token().kind != TokenKind::name) return expression();
  const auto start = lexer_;
  const auto name = lexer_.token();
  lexer_.advance();
  if (isAssignment(lexer_.token())) return assignment(name);
  const bool isSymbol = actions_.symbols().contains(name.text);
  const bool isRedirected =
      lexer_.token().isSymbol("<") || lexer_.token().isSymbol(">") || lexer_.token().isSymbol(">>");
  // After a symbol these are operators, and - & * are binary.
  const bool isPlainOperand = lexer_.token().kind != TokenKind::symbol && !isAtEnd();
  if (isPlainOperand || (!isSymbol && (isAtEnd() || beginsOperand() || isRedirected)))
    return bareCall(name);
  const bool isCall = lexer_.token().isSymbol("(");
  lexer_ = start;
  auto value = expression();
  if (isCall && (lexer_.token().isSymbol(">") || lexer_.token().isSymbol(">>"))) skipOutputFile();
  return value;
}

Value VxWorksLine::assignment(const Token& name) {
  auto symbol = lexer_.token().text;
  lexer_.advance();
  const auto column = lexer_.token().column;
  if (isAtEnd()) failAtToken("a value");
  const bool isOneName = lexer_.token().kind == TokenKind::name;
  const auto start = lexer_;
  if (isOneName) lexer_.advance();
  // `x = y` copies a symbol; as a statement of its own, `y` would be a call.
  const bool isCopy = isOneName && isAtEnd();
  lexer_ = start;
  auto value = isCopy ? expression() : statement();
  auto& symbols = actions_.symbols();
  if (value.is(Value::Kind::undefined)) {
    actions_.report(Severity::error, column, "undefined symbol " + value.name());
    value = Value::unavailable();
  }
  if (symbol != "=") {
    const auto found = symbols.find(name.text);
    const auto old = found == symbols.end() ? Value::undefined(name.text) : found->second;
    symbol.pop_back();
    value = applyBinary(symbol, old, value, name.column);
  }
  return symbols[name.text] = std::move(value);
}

bool VxWorksLine::beginsOperand() {
  static constexpr std::array<std::string_view, 6> kUnary = {"-", "+", "!", "~", "*", "&"};
  const auto& token = lexer_.token();
  if (token.kind != TokenKind::symbol) return token.kind != TokenKind::end;
  return std::ranges::find(kUnary, token.text) != kUnary.end();
}

Value VxWorksLine::bareCall(const Token& name) {
  std::vector<Argument> values;
  if (lexer_.token().isSymbol("<")) {
    const auto column = lexer_.token().column;
    const auto file = lexer_.readFileName();
    if (file.empty()) throw LineError{column, "the name of a file is expected after <"};
    values.push_back({Value::ofString(file), column});
  } else if (lexer_.token().isSymbol(">") || lexer_.token().isSymbol(">>")) {
    skipOutputFile();
  } else if (!isAtEnd()) {
    values = arguments();
  }
  if (!isAtEnd()) failAtToken("a comma or the end of the line");
  return actions_.call(name.text, std::move(values), name.column);
}

void VxWorksLine::skipOutputFile() {
  actions_.report(Severity::note, lexer_.token().column, "the output is not written to a file");
  static_cast<void>(lexer_.readFileName());
}

std::vector<Argument> VxWorksLine::arguments() {
  std::vector<Argument> values;
  for (;;) {
    const auto column = lexer_.token().column;
    if (lexer_.token().isSymbol(",") || lexer_.token().isSymbol(")")) {
      actions_.report(Severity::warning, column, "an argument is missing here; it counts as 0");
      values.push_back({Value(), column});
    } else {
      values.push_back({expression(), column});
    }
    if (!lexer_.token().isSymbol(",")) return values;
    lexer_.advance();
  }
}

Value VxWorksLine::expression(int lowest) {
  const Nesting nesting(nesting_, lexer_.token().column);
  auto left = operand();
  for (;;) {
    const auto symbol = lexer_.token();
    const int precedence = symbol.kind == TokenKind::symbol ? precedenceOf(symbol.text) : 0;
    if (precedence < lowest || precedence == 0) return left;
    lexer_.advance();
    left = applyBinary(symbol.text, left, expression(precedence + 1), symbol.column);
  }
}

Value VxWorksLine::operand() {
  const Nesting nesting(nesting_, lexer_.token().column);
  const auto token = lexer_.token();
  switch (token.kind) {
    case TokenKind::name:
      return nameOrCall();
    case TokenKind::integer:
      lexer_.advance();
      return Value::ofInteger(token.integer);
    case TokenKind::real:
      lexer_.advance();
      return Value::ofReal(token.real);
    case TokenKind::string:
      lexer_.advance();
      return Value::ofString(token.text);
    case TokenKind::symbol:
      break;
    case TokenKind::end:
      failAtToken("a value");
  }
  if (token.text == "&") return addressOf();
  if (token.text == "(") return parenthesized();
  if (!beginsOperand()) failAtToken("a value");
  lexer_.advance();
  const bool isOfAddress = token.text == "*" && lexer_.token().isSymbol("&");
  const auto value = operand();
  if (!isOfAddress) return applyUnary(token.text, value, token.column);
  const auto found = actions_.symbols().find(value.name());  // *&x is x
  return found == actions_.symbols().end() ? Value::undefined(value.name()) : found->second;
}

Value VxWorksLine::addressOf() {
  lexer_.advance();
  if (lexer_.token().kind != TokenKind::name) failAtToken("the name of a symbol");
  auto value = Value::ofAddress(lexer_.token().text);
  lexer_.advance();
  return value;
}

// `(type)value`. Returns false, and reads nothing, when the parenthesis begins an expression.
bool VxWorksLine::tryType(Value& value) {
  static constexpr std::array<std::string_view, 9> kTypes = {
      "int", "char", "short", "long", "unsigned", "signed", "float", "double", "void"};
  const auto isType = [&] {
    return lexer_.token().kind == TokenKind::name &&
           std::ranges::find(kTypes, lexer_.token().text) != kTypes.end();
  };
  if (!isType()) return false;
  bool isReal = false;
  for (; isType(); lexer_.advance())
    isReal = isReal || lexer_.token().text == "float" || lexer_.token().text == "double";
  const bool isPointer = lexer_.token().isSymbol("*");
  while (lexer_.token().isSymbol("*")) lexer_.advance();
  expect(")");
  value = operand();
  if (!isPointer) value = converted(value, isReal);
  return true;
}

Value VxWorksLine::parenthesized() {
  lexer_.advance();
  Value value;
  if (tryType(value)) return value;
  value = expression();
  expect(")");
  return value;
}

Value VxWorksLine::nameOrCall() {
  const auto name = lexer_.token();
  lexer_.advance();
  if (!lexer_.token().isSymbol("(")) {
    const auto found = actions_.symbols().find(name.text);
    return found == actions_.symbols().end() ? Value::undefined(name.text) : found->second;
  }
  lexer_.advance();
  std::vector<Argument> values;
  if (!lexer_.token().isSymbol(")")) values = arguments();
  if (!lexer_.token().isSymbol(")")) failAtToken("a comma or )");
  lexer_.advance();
  return actions_.call(name.text, std::move(values), name.column);
}

}  // namespace mpf::startup
