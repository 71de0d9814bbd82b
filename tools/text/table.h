// SPDX-License-Identifier: MIT
// Table: rows of cells under a heading. The columns are as wide as their widest cell, or fit the
// terminal.
//
// Threads  one.
#pragma once

#include <string>
#include <vector>

namespace mpf::tools {

class Table {
 public:
  // A heading that starts with '>' aligns its column to the right; a heading that starts with '~'
  // allows fitted() to cut the cells of its column.
  explicit Table(std::vector<std::string> headings);
  void add(std::vector<std::string> cells);
  [[nodiscard]] bool isEmpty() const noexcept { return rows_.size() == 1; }
  // One line for each row, with `indent` before it and no trailing blanks.
  [[nodiscard]] std::string text(const std::string& indent = {}) const;
  // The same in lineColumns() columns: the last column, if it is aligned to the left, is wrapped;
  // cells that may be cut end in "~"; a first cell that is still too long gets a line of its own.
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
