// SPDX-License-Identifier: MIT
// The processes of a measurement: on which CPUs they run, how they start and end. All die with the
// process that forked them.
//
// Threads  the calling process must have no other thread, because these functions fork.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <mpf/clock.h>

namespace mpf::bench {

using Cpus = std::vector<int>;  // CPUs that a process may run on

// Pins the calling thread, and threads and processes that it starts, to these CPUs. Throws
// std::system_error.
void pinTo(const Cpus& cpus);
// CPUs that this process may run on.
[[nodiscard]] Cpus allowedCpus();
// "0" or "0, 2".
[[nodiscard]] std::string toString(const Cpus& cpus);
// Runs `body` in a process of its own that dies with this one. Returns its pid. The process ends
// with _Exit(), so that no destructors of the caller run in it.
[[nodiscard]] int forkProcess(const std::function<void()>& body);
// Starts a program, given its name or path and its arguments. Its process calls `prepare` first,
// and prints errors of `prepare` on stderr.
[[nodiscard]] int startProgram(std::vector<std::string> words,
                               const std::function<void()>& prepare);
inline constexpr int kNoSuchProgram = 127;  // exit status when the program cannot be executed
// Kills a child process and waits for its end.
void killProcess(int pid) noexcept;
// Whether a child process has ended; if so, it is reaped.
[[nodiscard]] bool hasEnded(int pid) noexcept;
void sleepFor(Nanoseconds duration);
// Calls `done` every 200 us until it returns true. False when it did not within `limit`.
[[nodiscard]] bool waitUntil(const std::function<bool()>& done, Nanoseconds limit);

}  // namespace mpf::bench
