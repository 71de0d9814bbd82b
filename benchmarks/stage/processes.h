// SPDX-License-Identifier: MIT
// Processes: those that a measurement is made of: where they run, how they begin and end. All die
// with the one that made them.
//
// Threads  fork from a process that has no other thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <mpf/clock.h>

namespace mpf::bench {

using Cpus = std::vector<int>;  // that a process may run on

// Pins the calling thread, and threads and processes that it starts, to these CPUs. Throws
// std::system_error.
void pinTo(const Cpus& cpus);
// CPUs that this process may run on.
[[nodiscard]] Cpus allowedCpus();
// "0" or "0, 2".
[[nodiscard]] std::string toString(const Cpus& cpus);
// Runs `body` in a process of its own that dies with this one. Returns its pid. Nothing of the
// caller's is torn down at its end.
[[nodiscard]] int forkProcess(const std::function<void()>& body);
// Starts a program: a name or path, and arguments. Its process calls `prepare` first. What goes
// wrong there it says on stderr, as the program would.
[[nodiscard]] int startProgram(std::vector<std::string> words,
                               const std::function<void()>& prepare);
inline constexpr int kNoSuchProgram = 127;  // exit status when it cannot be started
// Ends a process that forkProcess() or fork() made and waits for it.
void killProcess(int pid) noexcept;
// True once it has ended; it is reaped then.
[[nodiscard]] bool hasEnded(int pid) noexcept;
void sleepFor(Nanoseconds duration);
// Waits until `done()`, looking every 200 us. False: not within `limit`.
[[nodiscard]] bool waitUntil(const std::function<bool()>& done, Nanoseconds limit);

}  // namespace mpf::bench
