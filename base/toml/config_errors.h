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
  // `place` is "FILE:LINE:COLUMN", or empty.
  void add(const std::string& place, const std::string& text) {
    lines_.push_back(place.empty() ? text : place + ": " + text);
  }
  [[nodiscard]] bool isEmpty() const noexcept { return lines_.empty(); }
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

  // Throws a ConfigError with all errors, in the order in which they were found.
  void throwIfAny() const {
    std::string text;
    for (const auto& line : lines_) text += (text.empty() ? "" : "\n") + line;
    if (!text.empty()) throw ConfigError(text);
  }

 private:
  std::vector<std::string> lines_;
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
