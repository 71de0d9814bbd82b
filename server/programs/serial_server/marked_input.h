// SPDX-License-Identifier: MIT
// MarkedInput: bytes received from a serial line, with marks where the line lost or damaged bytes.
//
//   1 2 | 5 6 \r 7 8 \r   an overrun between 2 and 5: "1256\r" contains the mark, "78\r" does not
//
// A mark stands before a byte; a mark after the last byte belongs to the byte that arrives next.
//
// Threads  one at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace mpf {

class MarkedInput {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  [[nodiscard]] bool empty() const noexcept { return bytes_.empty(); }
  [[nodiscard]] bool endsWith(const std::string& end) const { return bytes_.ends_with(end); }
  [[nodiscard]] std::size_t find(const std::string& text) const { return bytes_.find(text); }
  [[nodiscard]] std::string substr(std::size_t from, std::size_t count) const {
    return bytes_.substr(from, count);
  }

  void push_back(char byte) {  // NOLINT(readability-identifier-naming): as std::string has it
    bytes_.push_back(byte);
    marks_.push_back(std::exchange(nextMark_, std::uint8_t{0}));
  }
  // Removes bytes with their marks; a mark after the last byte stays.
  void erase(std::size_t from, std::size_t count) {
    bytes_.erase(from, count);
    const auto first = marks_.begin() + static_cast<std::ptrdiff_t>(from);
    marks_.erase(
        first, marks_.begin() + static_cast<std::ptrdiff_t>(std::min(from + count, marks_.size())));
  }
  // Removes all bytes and all marks.
  void clear() noexcept {
    bytes_.clear();
    marks_.clear();
    nextMark_ = 0;
  }

  // Adds a mark after the last byte.
  //   faults  serialFault... bits of <mpf/serial_commands.h>
  void mark(std::uint8_t faults) noexcept {
    nextMark_ = static_cast<std::uint8_t>(nextMark_ | faults);
  }
  // The faults of all marks before the first `count` bytes.
  [[nodiscard]] std::uint8_t faultsOfFirst(std::size_t count) const {
    std::uint8_t faults = 0;
    for (std::size_t i = 0; i < std::min(count, marks_.size()); ++i)
      faults = static_cast<std::uint8_t>(faults | marks_[i]);
    return faults;
  }

 private:
  std::string bytes_;
  std::vector<std::uint8_t> marks_;  // one for each byte
  std::uint8_t nextMark_ = 0;
};

}  // namespace mpf
