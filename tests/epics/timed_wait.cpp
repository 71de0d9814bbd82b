// SPDX-License-Identifier: MIT
// pthread_cond_timedwait() of this program, also for the libraries of EPICS Base. They wait until a
// time of the system clock: if that clock is set back by an hour, a wait of half a second takes an
// hour longer. This one waits for the same duration by the monotonic clock.
#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <chrono>

namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;

nanoseconds durationOf(const timespec& time) {
  return seconds(time.tv_sec) + nanoseconds(time.tv_nsec);
}
nanoseconds now(clockid_t clock) {
  timespec time{};
  ::clock_gettime(clock, &time);
  return durationOf(time);
}

}  // namespace

extern "C" int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                                      const timespec* deadline) {
  const auto end =
      std::max(durationOf(*deadline) - now(CLOCK_REALTIME) + now(CLOCK_MONOTONIC), nanoseconds(0));
  const auto full = std::chrono::floor<seconds>(end);
  const timespec time{full.count(), (end - full).count()};
  return pthread_cond_clockwait(condition, mutex, CLOCK_MONOTONIC, &time);
}
