// SPDX-License-Identifier: MIT
// Polling: keeps the event loop awake for a while after traffic, because a wake-up costs more than
// the way of a message through the router.
//
//   asleep ─ noteTraffic() ─► polling ─ no traffic for PollBudget::ns() ─► asleep
//
// While it polls, it gives up the processor in each turn: clients and servers on the same processor
// run first.
//
// Threads  that of the event loop.
#pragma once

#include <cstdint>
#include <kj/async-unix.h>

#include "router/fatal_tasks.h"
#include "router/poll_budget.h"

namespace mpf::router {

class Polling {
 public:
  explicit Polling(kj::UnixEventPort& port) noexcept : port_(port) {}

  // Messages have arrived or were sent.
  void noteTraffic();
  [[nodiscard]] bool isPolling() const noexcept { return isPolling_; }

 private:
  kj::Promise<void> loop();

  kj::UnixEventPort& port_;
  PollBudget budget_;
  std::int64_t lastTrafficNs_ = 0;
  std::uint32_t idleTurns_ = 0;  // of the loop, since the last traffic
  bool isPolling_ = false;
  FatalTasks tasks_;
};

}  // namespace mpf::router
