// SPDX-License-Identifier: MIT
// SignalsBlocked: while it lives, the calling thread gets no signals, and neither do threads that
// it starts: signals belong to the program's own threads. Those of a thread's own faults stay: to
// block them is to be killed by them.
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
