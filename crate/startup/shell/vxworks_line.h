// SPDX-License-Identifier: MIT
// VxWorksLine: parses and executes one line in the language of the vxWorks shell. The grammar is in
// startup_shell.h.
//
//   line ─► Lexer ─► VxWorksLine ─► LineActions
//
// Threads  one.
// Trust    any bytes; a line that is wrong throws LineError, after the statements before the error.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "crate/startup/shell/lexer.h"
#include "crate/startup/shell/line_actions.h"

namespace mpf::startup {

class VxWorksLine {
 public:
  VxWorksLine(std::string_view line, LineActions& actions) : lexer_(line), actions_(actions) {}

  void execute();

 private:
  Value statement();
  Value assignment(const Token& name);
  Value bareCall(const Token& name);
  void skipOutputFile();
  Value expression(int lowest = 1);
  Value operand();
  Value addressOf();
  Value parenthesized();
  bool tryType(Value& value);
  Value nameOrCall();
  std::vector<Argument> arguments();
  [[nodiscard]] bool isAtEnd() {
    return lexer_.token().kind == Token::Kind::end || lexer_.token().isSymbol(";");
  }
  [[nodiscard]] bool beginsOperand();
  void expect(std::string_view symbol);
  [[noreturn]] void failAtToken(const std::string& expected);

  Lexer lexer_;
  LineActions& actions_;
  std::size_t nesting_ = 0;
};

}  // namespace mpf::startup
