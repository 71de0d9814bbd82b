// SPDX-License-Identifier: MIT
// WaitMode: how a client or a server waits for the next message. Each process chooses for itself;
// its peers wake it in the way that it needs.
#pragma once

#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf {

// The numbers are part of the layout of the shared memory.
enum class WaitMode : std::uint32_t {
  // Polls until a message is there: the shortest latency; one processor is always busy.
  spin = 0,
  // The default. Polls for about twice as long as a wake-up has cost lately, then sleeps; sleeps at
  // once while others need the processor and polling brings no message.
  adaptive = 1,
  // Sleeps at once: uses no processor time while idle; a wake-up takes some tens of microseconds.
  block = 2,
};

}  // namespace mpf
