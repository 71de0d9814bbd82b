// SPDX-License-Identifier: MIT
// Watchdog: a test that hangs ends with a sentence instead of silence, and its guard removes what
// it leaves. Not an upper time limit: what takes a second alone takes half a minute beside fifty
// other processes on two processors, so a quarter of an hour is a hang. A timer and not a thread: a
// test that forks a child should have one thread, since what the others were doing is lost in the
// child.
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
#ifndef __SANITIZE_THREAD__  // it holds handlers back, maybe for ever; the signal ends the process all the same
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
  // One test at a time.
  static std::array<char, 256>& text() {
    static std::array<char, 256> theText{};
    return theText;
  }
  timer_t timer_{};
};

}  // namespace mpf::test
