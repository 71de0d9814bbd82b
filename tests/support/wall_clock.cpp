// SPDX-License-Identifier: MIT
// A library to preload: the wall clock of the program is behind by the number of seconds in the
// file $MPF_TEST_WALL_CLOCK, which is read at each call. The other clocks are unchanged.
// (libfaketime is not used because it leaves files in /dev/shm when its program is killed.)
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const auto result = static_cast<int>(::syscall(SYS_clock_gettime, clock, now));
  if (result != 0 || clock != CLOCK_REALTIME) return result;
  auto* const file = std::fopen(std::getenv("MPF_TEST_WALL_CLOCK"), "re");
  long seconds = 0;
  if (file == nullptr || std::fscanf(file, "%ld", &seconds) != 1) std::abort();
  std::fclose(file);
  now->tv_sec -= seconds;
  return 0;
}
