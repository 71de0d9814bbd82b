// SPDX-License-Identifier: MIT
#include "tools/text/table.h"

#include <algorithm>
#include <fmt/format.h>
#include <numeric>

#include "tools/text/wrap.h"

namespace mpf::tools {

namespace {

constexpr std::size_t kGap = 2;
constexpr std::size_t kLeastCut = 8;    // minimum columns of a cell that is cut
constexpr std::size_t kLeastText = 20;  // minimum columns of a text that is wrapped

std::size_t sumOf(const std::vector<std::size_t>& widths) {
  return std::accumulate(widths.begin(), widths.end(), kGap * (widths.size() - 1));
}

}  // namespace

Table::Table(std::vector<std::string> headings) {
  for (auto& heading : headings) {
    const Column column{heading.starts_with('>'), heading.starts_with('~')};
    columns_.push_back(column);
    if (column.isRight || column.mayBeCut) heading.erase(0, 1);
  }
  rows_.push_back(std::move(headings));
}

void Table::add(std::vector<std::string> cells) {
  cells.resize(columns_.size());
  rows_.push_back(std::move(cells));
}

std::vector<std::size_t> Table::widths() const {
  std::vector<std::size_t> widths(columns_.size());
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], columnsOf(row[i]));
  }
  return widths;
}

// The widths of the columns in `room` columns. Where they do not fit, the last column becomes
// narrower first, then the columns that may be cut, then the first one.
std::vector<std::size_t> Table::fit(std::size_t room) const {
  auto widths = this->widths();
  const auto narrow = [&](std::size_t column, std::size_t least) {
    const auto sum = sumOf(widths);
    if (sum <= room || widths[column] <= least) return;
    widths[column] -= std::min(sum - room, widths[column] - least);
  };
  if (!columns_.back().isRight) narrow(widths.size() - 1, kLeastText);
  for (std::size_t i = 0; i < widths.size(); ++i) {
    if (columns_[i].mayBeCut) narrow(i, std::max(columnsOf(rows_.front()[i]), kLeastCut));
  }
  if (!columns_.back().isRight) narrow(widths.size() - 1, kLeastText / 2);
  narrow(0, columnsOf(rows_.front().front()));
  return widths;
}

// The first `count` cells of a row.
std::string Table::cells(const std::vector<std::string>& row,
                         const std::vector<std::size_t>& widths, std::size_t count) const {
  std::string line;
  for (std::size_t i = 0; i < count; ++i) {
    const auto cell = columns_[i].mayBeCut ? cut(row[i], widths[i]) : row[i];
    line += columns_[i].isRight ? fmt::format("{:>{}}  ", cell, widths[i])
                                : fmt::format("{:<{}}  ", cell, widths[i]);
  }
  return line;
}

std::string Table::text(const std::string& indent) const {
  const auto widths = this->widths();
  std::string text;
  for (const auto& row : rows_) {
    auto line = indent + cells(row, widths, row.size());
    line.erase(line.find_last_not_of(' ') + 1);
    text += line;
    text += '\n';
  }
  return text;
}

std::string Table::fitted(const std::string& indent) const {
  const auto widths = fit(lineColumns() - indent.size());
  const bool wrapsLastColumn = columns_.size() > 1 && !columns_.back().isRight;
  std::string text;
  for (auto row : rows_) {
    if (columnsOf(row.front()) > widths.front()) {
      text += wrap(indent, row.front(), indent.size() + kGap);
      row.front().clear();
    }
    auto line = indent;
    line += cells(row, widths, row.size() - (wrapsLastColumn ? 1 : 0));
    if (wrapsLastColumn) {
      const auto width = columnsOf(line);
      if (width + kLeastCut <= lineColumns()) line = wrap(line, row.back(), width);
      else line += row.back();
    }
    line.erase(line.find_last_not_of(" \n") + 1);
    text += line + '\n';
  }
  return text;
}

}  // namespace mpf::tools
