// SPDX-License-Identifier: MIT
// Watchdog: ends a test that hangs, with the stacks of its threads; the guard then cleans up. It is
// not an upper time limit: a test that takes a second alone takes half a minute beside fifty other
// processes on two processors, so only a quarter of an hour counts as a hang. A machine that was
// paused, such as a virtual one, may find an hour gone when it continues: the quarter of an hour
// consists of 15 periods, each of which begins when the one before has been noticed, so a pause
// counts as one period at most.
// It is a timer and not a thread, because a test that forks should have one thread: the other
// threads do not exist in the child.
#pragma once

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/system_call.h"
#include "tests/support/thread_stacks.h"

namespace mpf::test {

class Watchdog {
 public:
  // Shorter than the timeout of the presets (CMakePresets.json): ctest kills the guard, too.
  static constexpr std::chrono::seconds kPatience{900};

  explicit Watchdog(const std::string& what, std::chrono::milliseconds patience = kPatience) {
    auto& state = theState();
    if (std::exchange(state.exists, true)) throw std::logic_error("this test has two watchdogs");
    state.text = {};
    ("watchdog: " + what + " hangs\n").copy(state.text.data(), state.text.size() - 1);
// ThreadSanitizer may delay signal handlers forever. There, the signal without a handler ends the
// process.
#ifdef __SANITIZE_THREAD__
    state.periods = 1;
#else
    state.periods = 15;
    struct sigaction action{};
    action.sa_handler = [](int) { endPeriod(); };
    action.sa_flags = SA_RESTART;
    checkCall(::sigaction(SIGALRM, &action, nullptr), "sigaction");
#endif
    checkCall(::timer_create(CLOCK_MONOTONIC, nullptr, &state.timer), "timer_create");  // SIGALRM
    const std::chrono::nanoseconds period = patience / state.periods;
    const auto full = std::chrono::floor<std::chrono::seconds>(period);
    state.period.it_value = {full.count(), (period - full).count()};
    checkCall(::timer_settime(state.timer, 0, &state.period, nullptr), "timer_settime");
  }
  ~Watchdog() {
    ::timer_delete(theState().timer);
    theState().exists = false;
  }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  struct State {
    std::array<char, 256> text{};
    timer_t timer{};
    itimerspec period{};
    int periods = 0;  // that are left
    bool exists = false;
  };
  // Static: only one test runs at a time.
  static State& theState() {
    static State state;
    return state;
  }

  static void endPeriod() {
    auto& state = theState();
    if (--state.periods > 0) {
      ::timer_settime(state.timer, 0, &state.period, nullptr);
      return;
    }
    [[maybe_unused]] const auto written =
        ::write(STDERR_FILENO, state.text.data(), std::strlen(state.text.data()));
    printThreadStacks();
    ::signal(SIGABRT, SIG_DFL);
    ::raise(SIGABRT);
  }
};

}  // namespace mpf::test
