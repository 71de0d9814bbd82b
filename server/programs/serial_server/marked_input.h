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
#include <string_view>
#include <utility>
#include <vector>

namespace mpf {

class MarkedInput {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size() - start_; }
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  [[nodiscard]] bool endsWith(std::string_view end) const { return all().ends_with(end); }
  [[nodiscard]] std::size_t find(std::string_view text) const { return all().find(text); }
  [[nodiscard]] std::string_view first(std::size_t count) const { return all().substr(0, count); }

  void push_back(char byte) {  // NOLINT(readability-identifier-naming): as std::string has it
    bytes_.push_back(byte);
    marks_.push_back(std::exchange(nextMark_, std::uint8_t{0}));
  }
  // Removes the first bytes with their marks; a mark after the last byte stays. Moves the other
  // bytes only when they are fewer than those that were removed: the cost does not depend on them.
  void eraseFirst(std::size_t count) {
    start_ += std::min(count, size());
    if (start_ < size()) return;
    bytes_.erase(0, start_);
    marks_.erase(marks_.begin(), marks_.begin() + static_cast<std::ptrdiff_t>(start_));
    start_ = 0;
  }
  // Removes all bytes and all marks.
  void clear() noexcept {
    bytes_.clear();
    marks_.clear();
    start_ = 0;
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
    for (std::size_t i = 0; i < std::min(count, size()); ++i)
      faults = static_cast<std::uint8_t>(faults | marks_[start_ + i]);
    return faults;
  }

 private:
  [[nodiscard]] std::string_view all() const { return std::string_view(bytes_).substr(start_); }
  std::string bytes_;  // those before start_ have been removed
  std::vector<std::uint8_t> marks_;  // one for each byte
  std::size_t start_ = 0;
  std::uint8_t nextMark_ = 0;
};

}  // namespace mpf
