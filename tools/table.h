// SPDX-License-Identifier: MIT
// Table: rows of cells under a heading, in columns as wide as they must be.
//
// Threads  one.
#pragma once

#include <string>
#include <vector>

namespace mpf::tools {

class Table {
 public:
  // Columns whose heading starts with '>' are aligned to the right.
  explicit Table(std::vector<std::string> headings);
  void add(std::vector<std::string> cells);
  [[nodiscard]] bool isEmpty() const noexcept { return rows_.size() == 1; }
  // One line a row, each after `indent`, no blanks at its end.
  [[nodiscard]] std::string text(const std::string& indent = {}) const;

 private:
  std::vector<bool> toTheRight_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace mpf::tools
