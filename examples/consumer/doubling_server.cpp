// SPDX-License-Identifier: MIT
// doubling_server: waits for SIGTERM.
#include <csignal>

#include <mpf/base/clock.h>

int main() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  sigprocmask(SIG_BLOCK, &ends, nullptr);
  int signal = 0;
  return mpf::Clock::nowNs() > 0 ? sigwait(&ends, &signal) : 1;
}
