// SPDX-License-Identifier: MIT
// MarkedInput: bytes that a serial line has brought, with marks where the line has lost or damaged
// bytes between them.
//
//   1 2 | 5 6 \r 7 8 \r        an overrun between 2 and 5: the answer "1256\r" spans it, the next
//   one does not
//
// A mark stands before a byte; a mark behind the last byte belongs to the byte that comes next.
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
  // With their marks; the mark behind the last byte stays.
  void erase(std::size_t from, std::size_t count) {
    bytes_.erase(from, count);
    const auto first = marks_.begin() + static_cast<std::ptrdiff_t>(from);
    marks_.erase(
        first, marks_.begin() + static_cast<std::ptrdiff_t>(std::min(from + count, marks_.size())));
  }
  // All bytes and all marks.
  void clear() noexcept {
    bytes_.clear();
    marks_.clear();
    nextMark_ = 0;
  }

  // Bytes are missing here, behind the last byte. `faults`: bits of serial_server.h.
  void mark(std::uint8_t faults) noexcept {
    nextMark_ = static_cast<std::uint8_t>(nextMark_ | faults);
  }
  // Which faults the first `count` bytes span.
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
