// SPDX-License-Identifier: MIT
// FileDescriptor: owns one open file and closes it. Movable, not copyable.
//
//   mpf::FileDescriptor file(::open(path, O_RDONLY | O_CLOEXEC));
//   if (!file) ...  // errno says why
//
// Threads  one at a time. Functions are noexcept and do not allocate.
// Crash    the kernel closes the file when the process ends.
// Fork     parent and child each own their copy. The kernel closes it at exec only if the caller
//          has passed O_CLOEXEC to open(2).
#pragma once

#include <unistd.h>

#include <utility>

#include <mpf/detail/cpp20.h>

namespace mpf {

class FileDescriptor {
 public:
  // Owns no file.
  FileDescriptor() noexcept = default;
  // Becomes the owner of `fd`, which no other object may own or close. A negative value, such as
  // the result of a failed open(2), means no file.
  explicit FileDescriptor(int fd) noexcept : fd_(fd) {}
  // After a move, `other` owns no file. Assignment closes the file that this object owned.
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    if (this != &other) reset(std::exchange(other.fd_, -1));
    return *this;
  }
  ~FileDescriptor() { reset(); }

  // The number of the file, for system calls; this object still owns it, and it is valid until
  // reset(), a move or the destructor. Negative if it owns none.
  [[nodiscard]] int get() const noexcept { return fd_; }
  // Whether it owns a file.
  explicit operator bool() const noexcept { return fd_ >= 0; }
  // Returns the number of the file without closing it: the caller is now its owner. Negative if
  // there was none.
  [[nodiscard]] int release() noexcept { return std::exchange(fd_, -1); }
  // Closes the file, if there is one, and becomes the owner of `fd`, which must not be the number
  // that this object owns. Ignores errors of close(2), which may change errno: a program that must
  // know whether its data were written calls fsync(2) before.
  void reset(int fd = -1) noexcept {
    if (fd_ >= 0) ::close(fd_);
    fd_ = fd;
  }

 private:
  int fd_ = -1;
};

}  // namespace mpf
