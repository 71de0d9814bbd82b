// SPDX-License-Identifier: MIT
// ErrorQueue: while it exists, writeError() and printError() do not wait for the reader of stderr.
// What a stopped terminal (Ctrl-S) or a pipe whose reader hangs does not accept is kept. While more
// than kMaxBytes would be kept, messages are dropped, and a line tells how many lines that were.
//
//   ErrorQueue errors;
//   polled.push_back({errors.descriptor(), POLLOUT, 0});
//   ::poll(...);
//   errors.flush();
//
// Threads  one, and it is the only one that prints.
// Crash    what is kept is lost.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <mpf/file_descriptor.h>

namespace mpf {

class ErrorQueue {
 public:
  static constexpr std::size_t kMaxBytes = 1 << 20;

  // At most one object at a time.
  ErrorQueue();
  // Waits up to a second for the reader; then the rest is lost.
  ~ErrorQueue();
  ErrorQueue(const ErrorQueue&) = delete;
  ErrorQueue& operator=(const ErrorQueue&) = delete;

  // The one that exists; nullptr: none.
  [[nodiscard]] static ErrorQueue* current() noexcept;

  // Whether the reader has taken everything.
  [[nodiscard]] bool isEmpty() const noexcept { return kept_.empty() && dropped_ == 0; }
  // For poll() and POLLOUT; negative while it is empty.
  [[nodiscard]] int descriptor() const noexcept;
  // Writes the message, or keeps it.
  void write(std::string_view message) noexcept;
  // Writes what is kept, as far as it is accepted.
  void flush() noexcept;

 private:
  void drop(std::string_view message) noexcept;
  void tryWriteKept() noexcept;
  [[nodiscard]] std::int64_t tryWrite(std::string_view bytes) const noexcept;

  FileDescriptor reopened_;  // stderr, opened again, so that nobody else is affected by O_NONBLOCK
  std::string kept_;
  std::uint64_t dropped_ = 0;  // lines, since the last line that told it
};

}  // namespace mpf
