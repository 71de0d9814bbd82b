// SPDX-License-Identifier: MIT
// LineActions: what a line of a startup file can do. The parsers of both dialects call it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "crate/startup/shell/startup_shell.h"

namespace mpf::startup {

class LineActions {
 public:
  virtual ~LineActions() = default;

  // Executes a command of the shell or of the handler.
  //   column  of the name in the line
  virtual Value call(const std::string& name, std::vector<Argument> arguments,
                     std::size_t column) = 0;
  // Executes another file.
  virtual void include(const std::string& file, std::size_t column) = 0;
  virtual void report(Severity severity, std::size_t column, const std::string& text) = 0;
  [[nodiscard]] virtual std::map<std::string, Value>& symbols() = 0;
};

}  // namespace mpf::startup
