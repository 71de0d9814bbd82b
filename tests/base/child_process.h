// SPDX-License-Identifier: MIT
// Child processes of tests: a test that closes or redirects its standard descriptors does so in a
// child, and keeps its own.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

// Runs `act` in a child. Returns its exit status, or minus the signal that killed it.
inline int endOf(const std::function<int()>& act) {
  std::fflush(nullptr);
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) ::_exit(act());
  int status = 0;
  checkCall(::waitpid(child, &status, 0), "waitpid");
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

// Whether the descriptor is open on /dev/null.
inline bool isNull(int descriptor) {
  struct stat status{};
  return ::fstat(descriptor, &status) == 0 && S_ISCHR(status.st_mode) &&
         status.st_rdev == makedev(1, 3);
}

// Closes those of the descriptors 0 to 2 whose bits are set.
inline void closeAll(unsigned subset) {
  for (int descriptor = 0; descriptor < 3; ++descriptor) {
    if ((subset >> descriptor & 1u) != 0) ::close(descriptor);
  }
}

inline void redirect(int descriptor, const char* path) {
  ::dup2(::open(path, O_WRONLY), descriptor);
}

// Captures stderr.
class Errors {
 public:
  Errors() : file_(::memfd_create("stderr", MFD_CLOEXEC)) {}
  void take() const { ::dup2(file_.get(), STDERR_FILENO); }
  [[nodiscard]] std::string text() const {
    std::string text(static_cast<std::size_t>(::lseek(file_.get(), 0, SEEK_END)), '\0');
    text.resize(static_cast<std::size_t>(::pread(file_.get(), text.data(), text.size(), 0)));
    return text;
  }

 private:
  FileDescriptor file_;
};

}  // namespace mpf::test
