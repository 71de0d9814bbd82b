// SPDX-License-Identifier: MIT
// CommandCall: one command of a startup file with its arguments, converted and checked. What is
// wrong is reported at the argument, and all arguments are read, so that all errors are found.
//
//   Value initDAC128V(CommandCall& call, StartupSite& site) {
//     const auto module = call.name(0, "module");
//     const auto queueSize = call.queueSize(3);
//     if (!call.isValid()) return Value::unavailable();
//
// Missing arguments are 0, as on vxWorks.
//
// Threads  one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include "crate/startup/shell/startup_shell.h"

namespace mpf::startup {

class CommandCall {
 public:
  CommandCall(const Command& command, StartupShell& shell) : command_(command), shell_(shell) {}

  // False after any report of an error.
  [[nodiscard]] bool isValid() const noexcept { return isValid_; }
  // Whether an argument was written.
  [[nodiscard]] bool has(std::size_t index) const { return index < command_.arguments.size(); }
  [[nodiscard]] std::size_t size() const { return command_.arguments.size(); }
  [[nodiscard]] Value value(std::size_t index) const { return command_.argument(index); }

  //   what  name of the argument, for errors
  // A text that is not empty.
  std::string text(std::size_t index, std::string_view what);
  // The same without commas, which separate the fields of options.
  std::string name(std::size_t index, std::string_view what);
  // A text that may be empty or missing.
  std::string textOr(std::size_t index, std::string_view what, std::string otherwise);
  std::int64_t integer(std::size_t index, std::string_view what, std::int64_t least,
                       std::int64_t most);
  // Requests of one client that may wait; 0: the default of the program.
  std::int64_t queueSize(std::size_t index);
  // The first character of "N", or of 'N'; `otherwise` when the argument is missing.
  char letter(std::size_t index, std::string_view what, std::string_view allowed, char otherwise);

  // Reports an error at an argument, unless one was reported there before.
  void refuse(std::size_t index, const std::string& text);
  void warn(const std::string& text) { shell_.report(Severity::warning, command_, text); }
  // Says that this command, or the part of it that `what` names, is not executed, and why.
  void skip(Severity severity, const std::string& what, const std::string& why) {
    shell_.reportSkipped(severity, command_, what + " is skipped: " + why);
  }

  [[nodiscard]] const std::string& commandName() const noexcept { return command_.name; }
  [[nodiscard]] std::string place() const { return command_.place.text(); }
  // "st.cmd:12: initDAC128V(...)", for comments.
  [[nodiscard]] std::string source() const;
  [[nodiscard]] const StartupShell& shell() const noexcept { return shell_; }

 private:
  // Reports an argument that has not the expected type, which `expected` describes.
  void refuseType(std::size_t index, std::string_view what, std::string_view expected);

  const Command& command_;
  StartupShell& shell_;
  bool isValid_ = true;
  std::set<std::size_t> refused_;  // arguments
};

}  // namespace mpf::startup
