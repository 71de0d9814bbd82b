// SPDX-License-Identifier: MIT
// FileLocks: numbered things of which each belongs to one process at a time. A lock ends with the process, however that ends.
// They are locks on single bytes of a file, whose bytes nobody touches (fcntl F_OFD_SETLK).
// Threads  any.
#pragma once

#include <fcntl.h>

#include <utility>

#include <mpf/base/file_descriptor.h>

namespace mpf {

class FileLocks {
 public:
  // `file` is open for reading and writing.
  explicit FileLocks(FileDescriptor file) noexcept : file_(std::move(file)) {}

  // False: somebody else has it. What this object has already it gets again.
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
