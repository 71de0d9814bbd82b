// SPDX-License-Identifier: MIT
// ConfigErrors: all errors of a configuration, so that its author corrects them at once.
//
//   readers ─ add() ─► ConfigErrors ─ throwIfAny() ─► ConfigError
//
// Threads  one.
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace mpf {

// Its text has one line for each error: "FILE:LINE:COLUMN: what is wrong, and what to write", or
// "--option: ..." for a command line.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class ConfigErrors {
 public:
  // `place` is "FILE:LINE:COLUMN", or another text, or empty.
  void add(const std::string& place, const std::string& text);
  [[nodiscard]] bool isEmpty() const noexcept { return lines_.empty(); }
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

  // Throws a ConfigError with all errors, in the order of their lines and columns; those without
  // are last.
  void throwIfAny() const;

 private:
  using Position = std::pair<unsigned, unsigned>;  // line and column
  std::vector<std::string> lines_;
  std::vector<Position> positions_;  // of each line
};

// The place of each key of a table, in the form in which errors begin: "FILE:LINE:COLUMN" or
// "--listen". The key "" is the table itself.
struct Places : std::map<std::string, std::string> {
  using map::map;

  // The place of `key`, or of the table when the key is absent.
  [[nodiscard]] const std::string& of(const std::string& key) const {
    const auto found = find(key);
    return found != end() ? found->second : at("");
  }
};

}  // namespace mpf
