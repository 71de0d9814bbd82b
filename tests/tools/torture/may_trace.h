// SPDX-License-Identifier: MIT
// Whether this host lets a process trace its children; containers often do not.
#pragma once

#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/system_call.h"

namespace mpf::test {

inline bool mayTrace() {
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    for (;;) ::pause();
  }
  const bool may = ::ptrace(PTRACE_SEIZE, child, nullptr, nullptr) == 0;
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return may;
}

}  // namespace mpf::test
