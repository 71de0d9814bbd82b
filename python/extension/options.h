// SPDX-License-Identifier: MIT
// Arguments of Python as values of C++, and the number of forks of this process.
#pragma once

#include <chrono>
#include <string>

#include <mpf/clock.h>
#include <mpf/wait_mode.h>

namespace mpf::python {

// [s] from now; negative: now, infinity: never. Throws std::invalid_argument when it is NaN.
[[nodiscard]] Deadline deadlineOf(double seconds);
// "spin", "adaptive" or "block". Throws std::invalid_argument for other words.
[[nodiscard]] WaitMode waitModeOf(const std::string& word);

// Interval at which a wait looks for signals: the longest delay of a signal handler of Python.
inline constexpr std::chrono::milliseconds kLookForSignals{100};

// Differs between a process and the children that it forks.
[[nodiscard]] int forkCount() noexcept;
// To be called once, before forkCount().
void countForks();

}  // namespace mpf::python
