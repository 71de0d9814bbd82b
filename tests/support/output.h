// SPDX-License-Identifier: MIT
// Output: everything that a process writes to a pipe. A thread reads it at once, so the process
// never blocks on the pipe. waitForLine() finds a line that was written before or after the call,
// so the order of lines of different threads does not matter.
//
//   Output output(std::move(readEnd));
//   output.waitForLine("listening on");
//
// Threads  any.
#pragma once

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

class Output {
 public:
  explicit Output(FileDescriptor readEnd)
      : readEnd_(std::move(readEnd)),
        bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")) {
    thread_ = std::jthread([this](const std::stop_token& stop) { collect(stop); });
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // Returns the first line that contains `text`, without its line end, of all lines since the start
  // of the process. Waits for such a line. Empty if the output ends without one.
  std::string waitForLine(std::string_view text) {
    std::unique_lock lock(mutex_);
    for (std::size_t begin = 0;;) {
      const auto line = waitForLineAt(begin, lock);
      if (!line || line->find(text) != std::string::npos) return line.value_or("");
      begin += line->size() + 1;
    }
  }
  // Returns the next line that nextLine() has not returned yet. Waits for it. Empty if the output
  // ends. For programs that write all lines in one thread: only then is their order certain.
  std::string nextLine() {
    std::unique_lock lock(mutex_);
    const auto line = waitForLineAt(taken_, lock);
    taken_ = std::min(taken_ + (line ? line->size() + 1 : 0), text_.size());
    return line.value_or("");
  }
  // Waits for the end of the output. Returns all that nextLine() has not returned.
  std::string rest() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return hasEnded_; });
    return text_.substr(taken_);
  }

 private:
  // Text without a line end at the end of the output is also a line.
  std::optional<std::string> waitForLineAt(std::size_t begin, std::unique_lock<std::mutex>& lock) {
    changed_.wait(lock, [&] { return hasEnded_ || text_.find('\n', begin) != std::string::npos; });
    if (begin >= text_.size()) return std::nullopt;
    return text_.substr(begin, text_.find('\n', begin) - begin);
  }
  void collect(const std::stop_token& stop) {
    const std::stop_callback wake(stop,
                                  [this] { static_cast<void>(::eventfd_write(bell_.get(), 1)); });
    std::array<char, 4096> bytes{};
    while (!stop.stop_requested()) {
      std::array<pollfd, 2> ready{{{readEnd_.get(), POLLIN, 0}, {bell_.get(), POLLIN, 0}}};
      ::poll(ready.data(), ready.size(), -1);
      if (ready[0].revents == 0) continue;
      const auto length =
          retryInterrupted([&] { return ::read(readEnd_.get(), bytes.data(), bytes.size()); });
      if (length <= 0) break;
      const std::lock_guard lock(mutex_);
      text_.append(bytes.data(), static_cast<std::size_t>(length));
      changed_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    hasEnded_ = true;
    changed_.notify_all();
  }

  FileDescriptor readEnd_;
  FileDescriptor bell_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string text_;  // all below under mutex_
  std::size_t taken_ = 0;  // by nextLine()
  bool hasEnded_ = false;
  std::jthread thread_;  // last member: it ends before the members that it uses are destroyed
};

}  // namespace mpf::test
