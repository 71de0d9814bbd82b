// SPDX-License-Identifier: MIT
// A library to preload: chdir() waits until somebody opens the FIFO $MPF_TEST_HELD for writing.
#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <dlfcn.h>

extern "C" int chdir(const char* path) noexcept {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread changes the environment
  if (const char* const fifo = std::getenv("MPF_TEST_HELD"))
    ::close(::open(fifo, O_RDONLY | O_CLOEXEC));
  using Chdir = int (*)(const char*);
  return reinterpret_cast<Chdir>(::dlsym(RTLD_NEXT, "chdir"))(path);
}
