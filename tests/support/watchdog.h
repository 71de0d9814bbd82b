// SPDX-License-Identifier: MIT
// Watchdog: ends a test that hangs, with a message; the guard then cleans up. It is not an upper
// time limit: a test that takes a second alone takes half a minute beside fifty other processes on
// two processors, so only a quarter of an hour counts as a hang. It is a timer and not a thread,
// because a test that forks should have one thread: the other threads do not exist in the child.
#pragma once

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <string>

#include "base/system_call.h"

namespace mpf::test {

class Watchdog {
 public:
  // Shorter than the timeout of the presets (CMakePresets.json): ctest kills the guard, too.
  static constexpr std::chrono::seconds kPatience{900};

  explicit Watchdog(const std::string& what, std::chrono::seconds patience = kPatience) {
    ("watchdog: " + what + " hangs\n").copy(text().data(), text().size() - 1);
// ThreadSanitizer may delay signal handlers forever. There, the signal without a handler ends the
// process.
#ifndef __SANITIZE_THREAD__
    struct sigaction action{};
    action.sa_handler = [](int) {
      [[maybe_unused]] const auto written =
          ::write(STDERR_FILENO, text().data(), std::strlen(text().data()));
      ::signal(SIGABRT, SIG_DFL);
      ::raise(SIGABRT);
    };
    checkCall(::sigaction(SIGALRM, &action, nullptr), "sigaction");
#endif
    checkCall(::timer_create(CLOCK_MONOTONIC, nullptr, &timer_), "timer_create");  // sends SIGALRM
    itimerspec spec{};
    spec.it_value.tv_sec = patience.count();
    checkCall(::timer_settime(timer_, 0, &spec, nullptr), "timer_settime");
  }
  ~Watchdog() { ::timer_delete(timer_); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  // Static: only one test runs at a time.
  static std::array<char, 256>& text() {
    static std::array<char, 256> theText{};
    return theText;
  }
  timer_t timer_{};
};

}  // namespace mpf::test
