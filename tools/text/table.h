// SPDX-License-Identifier: MIT
// Table: rows of cells under a heading, in columns as wide as they must be, or in 80 columns.
//
// Threads  one.
#pragma once

#include <string>
#include <vector>

namespace mpf::tools {

class Table {
 public:
  // Columns whose heading starts with '>' are aligned to the right; with '~', may be cut to fit
  // into 80 columns.
  explicit Table(std::vector<std::string> headings);
  void add(std::vector<std::string> cells);
  [[nodiscard]] bool isEmpty() const noexcept { return rows_.size() == 1; }
  // One line a row, each after `indent`, no blanks at its end.
  [[nodiscard]] std::string text(const std::string& indent = {}) const;
  // The same in 80 columns: the last column, if it is text, goes on in further lines; what may be
  // cut ends in "~"; then a first cell that is too long stands in a line of its own.
  [[nodiscard]] std::string fitted(const std::string& indent = {}) const;

 private:
  struct Column {
    bool isRight = false;
    bool mayBeCut = false;
  };
  [[nodiscard]] std::vector<std::size_t> widths() const;
  [[nodiscard]] std::vector<std::size_t> fit(std::size_t room) const;
  [[nodiscard]] std::string cells(const std::vector<std::string>& row,
                                  const std::vector<std::size_t>& widths, std::size_t count) const;
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace mpf::tools
