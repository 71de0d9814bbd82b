// SPDX-License-Identifier: MIT
// WaitMode: how a process waits for the next message.
#pragma once

#include <cstdint>

namespace mpf {

// The numbers are those of the shared memory.
enum class WaitMode : std::uint32_t {
  spin = 0,      // polls: the shortest latency, and one CPU is always busy
  adaptive = 1,  // polls for a few microseconds, then sleeps: the default
  block = 2,     // sleeps at once: no CPU time while idle, some tens of microseconds to wake up
};

}  // namespace mpf
