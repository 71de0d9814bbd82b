// SPDX-License-Identifier: MIT
// Lexer: the tokens of a line in the language of the vxWorks shell. A copy is a position to which
// the parser can return.
//
// Threads  one.
// Trust    any bytes; what is no token throws LineError.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "crate/startup/shell/line_error.h"

namespace mpf::startup {

struct Token {
  enum class Kind { name, integer, real, string, symbol, end };
  Kind kind = Kind::end;
  std::string text;  // of a name, an operator, or the content of a string
  std::int64_t integer = 0;  // also of 'N'
  double real = 0;
  std::size_t column = 0;  // from 1

  [[nodiscard]] bool isSymbol(std::string_view symbol) const {
    return kind == Kind::symbol && text == symbol;
  }
};

class Lexer {
 public:
  explicit Lexer(std::string_view line) : line_(line) {}

  [[nodiscard]] const Token& token() {
    if (!isRead_) read();
    return token_;
  }
  void advance() {
    if (!isRead_) read();
    isRead_ = false;
  }
  // Reads the text after the token as the name of a file, with or without quotes, and goes on
  // behind it. Returns "" without one. The name need not consist of tokens: ../lib/cdCommands.68K
  std::string readFileName();

 private:
  void read();
  void skipBlanks();
  void readNumber();
  void readString();
  void readCharacter();
  [[nodiscard]] char readEscape();
  [[nodiscard]] char peek(std::size_t ahead = 0) const {
    return at_ + ahead < line_.size() ? line_[at_ + ahead] : '\0';
  }

  std::string_view line_;
  std::size_t at_ = 0;
  bool isRead_ = false;  // token_ was read, and at_ is behind it
  Token token_;
};

// The character of an escape of C such as \r, \015 or \x0d.
//   at  of the character after the backslash; moved behind the escape
[[nodiscard]] char readCEscape(std::string_view text, std::size_t& at);

// `text` with its escapes replaced. iocsh passes "\r" as two characters; a command that takes a
// terminator replaces them itself.
[[nodiscard]] std::string unescaped(std::string_view text);

}  // namespace mpf::startup
