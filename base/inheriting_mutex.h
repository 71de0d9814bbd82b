// SPDX-License-Identifier: MIT
// InheritingMutex: a mutex with priority inheritance. Its owner runs at the highest priority of
// the threads that wait for it.
//
// With std::mutex, an ordinary thread that holds the lock but does not get a processor delays a
// real-time thread that waits for the lock by the same time.
//
// Threads  any thread of one process.
#pragma once

#include <pthread.h>

#include "base/system_call.h"

namespace mpf {

// Meets the requirements of std::lock_guard.
class InheritingMutex {
 public:
  // Throws std::system_error if the kernel does not support priority inheritance.
  InheritingMutex() {
    pthread_mutexattr_t attributes;
    ::pthread_mutexattr_init(&attributes);
    int error = ::pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    if (error == 0) error = ::pthread_mutex_init(&mutex_, &attributes);
    ::pthread_mutexattr_destroy(&attributes);
    if (error != 0) throwSystemError(error, "pthread_mutex_init", "with priority inheritance");
  }
  ~InheritingMutex() { ::pthread_mutex_destroy(&mutex_); }
  InheritingMutex(const InheritingMutex&) = delete;
  InheritingMutex& operator=(const InheritingMutex&) = delete;

  // NOLINTBEGIN(readability-identifier-naming): the standard's names
  void lock() noexcept { ::pthread_mutex_lock(&mutex_); }
  [[nodiscard]] bool try_lock() noexcept { return ::pthread_mutex_trylock(&mutex_) == 0; }
  void unlock() noexcept { ::pthread_mutex_unlock(&mutex_); }
  // NOLINTEND(readability-identifier-naming)

 private:
  pthread_mutex_t mutex_{};
};

}  // namespace mpf
