// SPDX-License-Identifier: MIT
// FileLocks: divides numbered resources between processes; each belongs to one process at a time.
// The kernel drops the lock when the process ends, in whatever way.
//
// Each lock is on one byte of a file (fcntl F_OFD_SETLK); the contents of the file are not used.
//
// Threads  any number of callers at a time.
#pragma once

#include <fcntl.h>

#include <utility>

#include <mpf/file_descriptor.h>

namespace mpf {

class FileLocks {
 public:
  // `file` must be open for reading and writing.
  explicit FileLocks(FileDescriptor file) noexcept : file_(std::move(file)) {}

  // Returns false when another process or object holds the lock; true also when this object holds
  // it.
  [[nodiscard]] bool tryLock(int number) noexcept { return set(number, F_WRLCK); }
  void unlock(int number) noexcept { set(number, F_UNLCK); }

 private:
  bool set(int number, short type) noexcept {
    struct flock lock{};
    lock.l_type = type;
    lock.l_whence = SEEK_SET;
    lock.l_start = number;
    lock.l_len = 1;
    return ::fcntl(file_.get(), F_OFD_SETLK, &lock) == 0;
  }

  FileDescriptor file_;
};

}  // namespace mpf
