// SPDX-License-Identifier: MIT
// runCommand(): what a shell command writes to stdout, and how it ends. For tests that look at a
// program from outside; one that shall live on beside the test, or be signalled, is a Program.
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
  int status = 0;  // as waitpid() has it; 0: it ended well
};

// Waits for its end.
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
