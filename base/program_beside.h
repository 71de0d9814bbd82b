// SPDX-License-Identifier: MIT
// Programs of the same installation: they are in the folder of the running program. The Python
// package has only the program mpf: the others are in PATH then.
//
// Threads  any.
#pragma once

#include <string>
#include <vector>

namespace mpf {

// The path of a program in the folder of this program.
[[nodiscard]] std::string programBeside(const std::string& name);

// Replaces this process by the program `name` in the folder of this program, or else in PATH.
//   remedy   what the user does when it is not there
//   returns  1, after it has printed why it failed
[[nodiscard]] int executeProgram(const std::string& name, std::vector<std::string> arguments,
                                 const std::string& remedy);

}  // namespace mpf
