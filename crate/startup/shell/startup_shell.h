// SPDX-License-Identifier: MIT
// StartupShell: executes startup files of the original MPF, in the language of the vxWorks shell
// or of iocsh.
//
//   st.cmd ─► StartupShell ─ Command ─► CommandHandler      a command that the shell lacks
//                 │  ▲                        │
//                 │  └──────── Value ─────────┘             its result, or nullopt: unknown
//                 └─► Diagnostics
//
// Grammar of the vxWorks dialect. All operators have the precedence of C:
//
//   line       = "<" file | statement { ";" statement }      # and // begin a comment
//   statement  = [ name ("=" | "+=" | "-=" | ...) statement  an assignment creates the symbol
//              | name arguments                              a call without parentheses
//              | name "<" file                               ld < file: the name is an argument
//              | expression ]
//   arguments  = [ expression { "," expression } ]
//   expression = expression ("||" | "&&" | "|" | "^" | "&" | "==" | "!=" | "<" | "<=" | ">" | ">="
//                            | "<<" | ">>" | "+" | "-" | "*" | "/" | "%") expression
//              | ("-" | "+" | "!" | "~" | "*") expression | "&" name | "(" type ")" expression
//              | name "(" arguments ")" | "(" expression ")" | name | literal
//   literal    = 10 | 0x1F | 017 | 1.5e3 | 'N' | "text\015"  with all escapes of C
//
// Grammar of the iocsh dialect. $(MACRO), $(MACRO=default) and ${MACRO} are replaced first:
//
//   line       = "<" file | word { (blank | "," | "(" | ")") word }
//   word       = characters | "text" | 'text'              escapes stay as they are: unescaped()
//
// The shell itself defines cd, pwd, putenv, epicsEnvSet, epicsEnvShow, var, iocsh, iocshLoad,
// malloc, calloc, free, strcpy, strcat, strlen and sprintf; `ld` and all others go to the handler.
//
// Threads  one.
// Trust    a file may contain anything. Depth, sizes and counts are limited (Limits); what exceeds
//          them is an error of the file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "crate/startup/shell/diagnostics.h"
#include "crate/startup/shell/dialect.h"
#include "crate/startup/shell/shell_state.h"
#include "crate/startup/shell/value.h"

namespace mpf::startup {

class StartupShell;

struct Argument {
  Value value;
  std::size_t column = 0;  // where it begins in the line
};

// A command as the file has it, with evaluated arguments.
struct Command {
  std::string name;
  std::vector<Argument> arguments;
  Place place;  // of the name
  std::vector<Place> includedFrom;  // the outermost first
  std::string text;  // the line without its line end
  Dialect dialect = Dialect::vxWorks;

  // Missing arguments are 0.
  [[nodiscard]] Value argument(std::size_t index) const {
    return index < arguments.size() ? arguments[index].value : Value();
  }
};

class CommandHandler {
 public:
  virtual ~CommandHandler() = default;

  // Executes a command. An argument that is an undefined symbol has the kind `undefined`; the
  // handler reports it where the argument matters (StartupShell::reportArgument).
  //   returns  the result, Value() when it has none; Value::unavailable() after a failure that the
  //            handler has reported; nullopt: the command is unknown, which the shell reports as a
  //            warning
  virtual std::optional<Value> tryExecute(const Command& command, StartupShell& shell) = 0;
};

class StartupShell {
 public:
  struct Limits {
    static constexpr std::size_t kFileBytes = std::size_t{4} << 20;
    static constexpr std::size_t kLineBytes = std::size_t{64} << 10;
    static constexpr std::size_t kStringBytes = std::size_t{64} << 10;
    static constexpr std::size_t kAllStringBytes = std::size_t{64} << 20;  // ever written
    static constexpr std::size_t kIncludeDepth = 16;
    static constexpr std::size_t kFiles = 1000;  // executed
    static constexpr std::size_t kNesting = 64;  // of an expression
    static constexpr std::size_t kArguments = 10;  // on vxWorks; more cause a warning
  };

  //   folder  the current directory at the start
  StartupShell(CommandHandler& handler, std::filesystem::path folder);

  // Defines a symbol before the first file, such as those of cdCommands: top, topbin, startup.
  void define(const std::string& name, Value value) { state_.symbols[name] = std::move(value); }
  // Environment variables, which are also the macros of the iocsh dialect.
  void setEnvironment(const std::string& name, std::string value) {
    state_.environment[name] = std::move(value);
  }
  // Executes all files in this dialect instead of the detected one.
  void forceDialect(Dialect dialect) { forced_ = dialect; }

  // Executes a file and those that it includes, to the end, whatever is wrong in them.
  //   file  relative to the current directory of the shell
  void execute(const std::filesystem::path& file);

  [[nodiscard]] const Diagnostics& diagnostics() const noexcept { return diagnostics_; }
  [[nodiscard]] const std::map<std::string, Value>& symbols() const noexcept {
    return state_.symbols;
  }
  [[nodiscard]] const std::map<std::string, std::string>& environment() const noexcept {
    return state_.environment;
  }
  // Where `cd` has led; relative names of files in arguments are relative to it. The directory of
  // the process does not change.
  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return state_.folder; }

  // Reports something about a command, at its name or at one of its arguments (from 0).
  void report(Severity severity, const Command& command, const std::string& text);
  // The same for a command that is not executed; the text says that it is skipped, and why.
  void reportSkipped(Severity severity, const Command& command, const std::string& text);
  void reportArgument(Severity severity, const Command& command, std::size_t index,
                      const std::string& text);

 private:
  class Execution;
  //   from  the execution of the file that includes this one; nullptr: none
  void executeFile(const std::filesystem::path& file, const Execution* from, std::size_t column);

  CommandHandler& handler_;
  ShellState state_;
  std::optional<Dialect> forced_;
  std::size_t files_ = 0;  // executed
  Diagnostics diagnostics_;
};

}  // namespace mpf::startup
