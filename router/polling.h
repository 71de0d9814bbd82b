// SPDX-License-Identifier: MIT
// Polling: keeps the event loop awake for a while after traffic, because a wake-up takes longer
// than passing a message through the router.
//
//   asleep ─ noteTraffic() ─► polling ─ no traffic for PollBudget::ns() ─► asleep
//
// While it polls, it looks at the descriptors of the event loop, into the connections that were
// busy lately, and into the rings of the windows that were: their clients and servers need no
// system call to hand a message over. It yields the processor once in each turn, and at most once
// more in lookForAnswers(): clients and servers on this processor run first. After a long yield the
// router sleeps, and does not poll after the next bursts of traffic (SharedProcessor). What is due
// is written at the beginning and the end of each turn, and in lookForAnswers() (DueWrites).
//
// Threads  that of the event loop.
#pragma once

#include <cstdint>
#include <kj/async-unix.h>

#include "router/due_writes.h"
#include "router/fatal_tasks.h"
#include "router/poll_budget.h"
#include "router/polled.h"
#include "shm/shared_processor.h"

namespace mpf::router {

class Polling {
 public:
  // `port` and `writes` outlive this object.
  Polling(kj::UnixEventPort& port, DueWrites& writes) noexcept : port_(port), writes_(writes) {}

  // Messages have arrived or were sent.
  void noteTraffic();
  // Call them after noteTraffic(). While this object polls, it also polls this window or line,
  // until PolledSet::kMax others were added later. One that is not polled wakes the event loop by
  // its descriptor.
  void addWindow(Polled& window) {
    if (isPolling_) windows_.add(window);
  }
  void addLine(Polled& line) {
    if (isPolling_) lines_.add(line);
  }
  // Call it after messages were handed over. While this object polls, it yields the processor, so
  // that receivers on the same processor run, and looks at the windows, once in each turn. After a
  // long yield the next turn ends the polling.
  void lookForAnswers();
  // The window or line is destroyed.
  void remove(Polled& polled) noexcept;
  [[nodiscard]] bool isPolling() const noexcept { return isPolling_; }

 private:
  kj::Promise<void> nextTurn();
  kj::Promise<void> loop();
  bool tryYield(std::int64_t nowNs);
  void end();

  kj::UnixEventPort& port_;
  DueWrites& writes_;
  PollBudget budget_;
  SharedProcessor processor_;
  std::int64_t lastTrafficNs_ = 0;
  std::uint32_t idleTurns_ = 0;  // of the loop, since the last traffic
  bool isPolling_ = false;
  bool hasLooked_ = false;  // for answers, in this turn
  bool isCrowded_ = false;  // others use the processor for long: the next turn ends the polling
  PolledSet lines_;
  PolledSet windows_;
  FatalTasks tasks_;
};

}  // namespace mpf::router
