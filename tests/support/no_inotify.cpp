// SPDX-License-Identifier: MIT
// A library to preload: the user has no inotify instance left.
#include <sys/inotify.h>

#include <cerrno>

extern "C" int inotify_init1(int /*flags*/) noexcept {
  errno = EMFILE;
  return -1;
}
