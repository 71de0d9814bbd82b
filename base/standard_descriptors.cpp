// SPDX-License-Identifier: MIT
#include "base/standard_descriptors.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace mpf {
namespace {

int openNothing(int flags) noexcept {
  const int file = ::open("/dev/null", O_RDWR | flags);
  return file >= 0 ? file : ::open("/", O_RDONLY | O_DIRECTORY | flags);
}

}  // namespace

void openStandardDescriptors() noexcept {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    if (::fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    const int file = openNothing(0);  // gets the lowest free number, which is `descriptor`
    if (file < 0) return;  // no file can be opened, so no other file can get this number either
  }
}

void closeDescriptor(int descriptor) noexcept {
  const int nothing = descriptor <= STDERR_FILENO ? openNothing(O_CLOEXEC) : -1;
  if (nothing < 0) {
    ::close(descriptor);
    return;
  }
  ::dup2(nothing, descriptor);
  ::close(nothing);
}

}  // namespace mpf
