// SPDX-License-Identifier: MIT
// runMain(): what the main() of every program does around its work.
//
//   int main(int argc, char** argv) {
//     return mpf::runMain("mpf-x", [&] { return run(argc, argv); });
//   }
//
//   1. opens the descriptors 0 to 2 that are closed, before the program opens a file
//   2. does the work, and flushes stdout
//   3. reports an exception as one line on stderr, "mpf-x: MESSAGE", and never throws or aborts
//
// Threads  the main thread, once.
#pragma once

#include <functional>
#include <string_view>

namespace mpf {

// The exit statuses of all programs; a program may have others of its own.
inline constexpr int kExitFailed = 1;  // the message on stderr says what failed
inline constexpr int kExitUsage = 2;   // wrong arguments, or a name or value that cannot be

// Returns the exit status: what `work` returns; kExitUsage when it throws std::invalid_argument;
// kExitFailed when it throws anything else, or when what it printed to stdout cannot be written.
[[nodiscard]] int runMain(std::string_view program, const std::function<int()>& work) noexcept;

}  // namespace mpf
