// SPDX-License-Identifier: MIT
// SignalsBlocked: blocks signals in the calling thread, and in threads that it starts, while the
// object exists: signals are for the program's own threads, not for those of this library. The
// signals of a thread's own faults (SIGSEGV, SIGBUS, SIGFPE, SIGILL) stay unblocked, because the
// kernel kills a process when a thread causes such a fault while the signal is blocked.
//
// Threads  one thread constructs and destroys it.
#pragma once

#include <pthread.h>
#include <signal.h>

#include <initializer_list>

namespace mpf {

class SignalsBlocked {
 public:
  SignalsBlocked() noexcept {
    sigset_t most;
    ::sigfillset(&most);
    for (const int fault : {SIGBUS, SIGSEGV, SIGFPE, SIGILL}) ::sigdelset(&most, fault);
    ::pthread_sigmask(SIG_SETMASK, &most, &before_);
  }
  ~SignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace mpf
