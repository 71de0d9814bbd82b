// SPDX-License-Identifier: MIT
// ReaderWatch: calls a function when nobody can read stdout any more, as after the death of the
// program that reads it through a pipe. A program that writes seldom learns of it in no other way.
//
// Threads  one of its own, which calls the function; none if stdout is not a pipe or a socket.
#pragma once

#include <functional>
#include <thread>

#include <mpf/file_descriptor.h>

namespace mpf::tools {

class ReaderWatch {
 public:
  //   throws  std::system_error
  explicit ReaderWatch(std::function<void()> onGone);
  ~ReaderWatch();
  ReaderWatch(const ReaderWatch&) = delete;
  ReaderWatch& operator=(const ReaderWatch&) = delete;

 private:
  void watch() const;

  std::function<void()> onGone_;
  FileDescriptor end_;  // readable: the thread ends
  std::jthread thread_;
};

}  // namespace mpf::tools
