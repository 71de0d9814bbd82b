// SPDX-License-Identifier: MIT
// runCommand(): the stdout and the status of a shell command. For a program that must run beside
// the test, or that gets signals, use Program.
//
//   EXPECT_THAT(runCommand(program + " --help").output, StartsWith("mpf-x - "));
//
// Threads  any.
#pragma once

#include <array>
#include <cstdio>
#include <string>

#include "base/system_call.h"

namespace mpf::test {

struct EndedCommand {
  std::string output;
  int status = 0;  // status of waitpid(); 0: success
};

// Runs the command and waits for its end.
[[nodiscard]] inline EndedCommand runCommand(const std::string& command) {
  std::FILE* const pipe =
      ::popen(command.c_str(), "r");  // NOLINT(cert-env33-c): a test's own programs
  if (pipe == nullptr) throwSystemError(errno, "popen", command);
  EndedCommand ended;
  std::array<char, 4096> bytes{};
  while (const auto length = std::fread(bytes.data(), 1, bytes.size(), pipe))
    ended.output.append(bytes.data(), length);
  ended.status = ::pclose(pipe);
  return ended;
}

}  // namespace mpf::test
