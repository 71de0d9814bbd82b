// SPDX-License-Identifier: MIT
// A library to preload: pidfd_open() fails as in a kernel before 5.3.
#include <sys/syscall.h>

#include <array>
#include <cerrno>
#include <cstdarg>
#include <dlfcn.h>

extern "C" long syscall(long number, ...) noexcept {
  if (number == SYS_pidfd_open) {
    errno = ENOSYS;
    return -1;
  }
  std::array<long, 6> values{};  // more than some calls have, as in the C library
  va_list list;
  va_start(list, number);
  for (auto& value : values) value = va_arg(list, long);
  va_end(list);
  using Syscall = long (*)(long, ...);
  static const auto next = reinterpret_cast<Syscall>(::dlsym(RTLD_NEXT, "syscall"));
  return next(number, values[0], values[1], values[2], values[3], values[4], values[5]);
}
