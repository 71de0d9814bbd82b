// SPDX-License-Identifier: MIT
#include "crate/startup/shell/lexer.h"

#include <array>
#include <cctype>
#include <fmt/format.h>

#include "base/number.h"

namespace mpf::startup {
namespace {

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }

int digitValue(char c) {
  if (isDigit(c)) return c - '0';
  const int lower = std::tolower(static_cast<unsigned char>(c));
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : 16;
}

// The longest operators come first.
constexpr std::array<std::string_view, 36> kSymbols = {
    "<<=", ">>=", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+=", "-=",
    "*=",  "/=",  "%=", "&=", "|=", "^=", "+",  "-",  "*",  "/",  "%",  "&",
    "|",   "^",   "!",  "~",  "<",  ">",  "=",  "(",  ")",  ",",  ";",  "?"};

}  // namespace

char readCEscape(std::string_view text, std::size_t& at) {
  static constexpr std::string_view kNames = "abfnrtv";
  static constexpr std::string_view kValues = "\a\b\f\n\r\t\v";
  const auto digit = [&](std::size_t i, int base) {
    return i < text.size() && digitValue(text[i]) < base;
  };
  const char c = text[at];
  const bool isHex = c == 'x' && digit(at + 1, 16);
  if (!isHex && !digit(at, 8)) {
    ++at;
    const auto found = kNames.find(c);
    return found == std::string_view::npos ? c : kValues[found];
  }
  if (isHex) ++at;
  int value = 0;
  for (int i = 0; i < (isHex ? 2 : 3) && digit(at, isHex ? 16 : 8); ++i)
    value = value * (isHex ? 16 : 8) + digitValue(text[at++]);
  return static_cast<char>(value);
}

std::string unescaped(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const bool isEscape = text[at] == '\\' && at + 1 < text.size();
    if (isEscape) ++at;
    result += isEscape ? readCEscape(text, at) : text[at++];
  }
  return result;
}

void Lexer::skipBlanks() {
  for (;;) {
    while (at_ < line_.size() && std::isspace(static_cast<unsigned char>(line_[at_])) != 0) ++at_;
    if (peek() == '#' || (peek() == '/' && peek(1) == '/')) at_ = line_.size();
    if (peek() != '/' || peek(1) != '*') return;
    const auto end = line_.find("*/", at_ + 2);
    if (end == std::string_view::npos)
      throw LineError{at_ + 1, "the comment is not closed in this line: write */ at its end"};
    at_ = end + 2;
  }
}

void Lexer::read() {
  isRead_ = true;
  skipBlanks();
  token_ = Token{};
  token_.column = at_ + 1;
  if (at_ >= line_.size()) return;
  const char c = line_[at_];
  if (isLetter(c)) {
    token_.kind = Token::Kind::name;
    while (isLetter(peek()) || isDigit(peek())) token_.text += line_[at_++];
    return;
  }
  if (isDigit(c) || (c == '.' && isDigit(peek(1)))) return readNumber();
  if (c == '"') {
    token_.kind = Token::Kind::string;
    return readString();
  }
  if (c == '\'') return readCharacter();
  for (const auto symbol : kSymbols) {
    if (!line_.substr(at_).starts_with(symbol)) continue;
    token_.kind = Token::Kind::symbol;
    token_.text = symbol;
    at_ += symbol.size();
    return;
  }
  throw LineError{at_ + 1, fmt::format("unexpected character '{}'", c)};
}

void Lexer::readNumber() {
  const auto begin = at_;
  const bool isHex = peek() == '0' && (peek(1) == 'x' || peek(1) == 'X');
  while (isLetter(peek()) || isDigit(peek()) || peek() == '.' ||
         (!isHex && (peek() == '+' || peek() == '-') && (line_[at_ - 1] | 0x20) == 'e'))
    ++at_;
  const auto written = line_.substr(begin, at_ - begin);
  auto digits = written;
  const bool isReal = !isHex && digits.find_first_of(".eE") != std::string_view::npos;
  // 10L, 10UL and 1.5f are numbers of C.
  const std::string_view suffixes = isReal ? "fFlL" : "uUlL";
  while (digits.size() > 1 && suffixes.find(digits.back()) != std::string_view::npos)
    digits.remove_suffix(1);
  const auto valueOf = [&](const auto& number) {
    if (!number) throw LineError{begin + 1, fmt::format("{} is not a number", written)};
    return *number;
  };
  if (isReal) {
    token_.kind = Token::Kind::real;
    token_.real = valueOf(tryNumber<double>(digits));
  } else {
    token_.kind = Token::Kind::integer;
    const int base = isHex ? 16 : digits.size() > 1 && digits.front() == '0' ? 8 : 10;
    digits.remove_prefix(isHex ? 2 : 0);
    token_.integer = static_cast<std::int64_t>(valueOf(tryNumber<std::uint64_t>(digits, base)));
  }
}

char Lexer::readEscape() {
  if (peek() != '\\' || at_ + 1 >= line_.size()) return line_[at_++];
  ++at_;
  return readCEscape(line_, at_);
}

void Lexer::readString() {
  const auto begin = at_++;
  while (at_ < line_.size() && peek() != '"') token_.text += readEscape();
  if (at_ >= line_.size())
    throw LineError{begin + 1, "the string is not closed: write \" at its end"};
  ++at_;
  // As in C, a string ends at its first null character.
  if (const auto end = token_.text.find('\0'); end != std::string::npos) token_.text.resize(end);
}

void Lexer::readCharacter() {
  const auto begin = at_++;
  token_.kind = Token::Kind::integer;
  // NOLINTNEXTLINE(bugprone-signed-char-misuse): the value of a char, as in C
  if (at_ < line_.size()) token_.integer = readEscape();
  if (peek() != '\'')
    throw LineError{begin + 1, "one character is expected between ' and ', such as 'N'"};
  ++at_;
}

std::string Lexer::readFileName() {
  static_cast<void>(token());
  isRead_ = false;
  while (at_ < line_.size() && std::isspace(static_cast<unsigned char>(line_[at_])) != 0) ++at_;
  std::string name;
  if (peek() == '"') {
    token_ = Token{};
    readString();
    name = token_.text;
  } else {
    while (at_ < line_.size() && std::isspace(static_cast<unsigned char>(line_[at_])) == 0 &&
           line_[at_] != ';')
      name += line_[at_++];
  }
  return name;
}

}  // namespace mpf::startup
