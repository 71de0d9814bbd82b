// SPDX-License-Identifier: MIT
// runMain(): the frame of every program's main().
//
//   int main(int argc, char** argv) {
//     return mpf::runMain("mpf-x", [&] { return run(argc, argv); });
//   }
//
//   1. opens each of the descriptors 0 to 2 that is closed, before the program opens a file
//   2. runs the work, and flushes stdout
//   3. prints an exception as one line on stderr, "mpf-x: MESSAGE"; never throws or aborts
//
// Threads  the main thread, once.
#pragma once

#include <functional>
#include <string>

namespace mpf {

// The exit statuses of all programs. A program may define more.
inline constexpr int kExitFailed = 1;  // the message on stderr says what failed
inline constexpr int kExitUsage = 2;  // usage error: wrong arguments, or an invalid name or value

// Returns the exit status: the result of `work`; kExitUsage if `work` throws std::invalid_argument;
// kExitFailed if it throws another exception, or if its output to stdout cannot be written.
//   program  begins the messages; `work` may add the subcommand to it
[[nodiscard]] int runMain(const std::string& program, const std::function<int()>& work) noexcept;

}  // namespace mpf
