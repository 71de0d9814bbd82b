// SPDX-License-Identifier: MIT
// Polling: keeps the event loop awake for a while after traffic, because a wake-up takes longer
// than passing a message through the router.
//
//   asleep ─ noteTraffic() ─► polling ─ no traffic for PollBudget::ns() ─► asleep
//
// While it polls, it looks at the descriptors of the event loop, and into the rings of the windows
// that were busy lately: their clients and servers need no system call to hand a message over. It
// gives up the processor in each turn and after each frame: clients and servers on the same
// processor run first. If others then use it for long, the router sleeps, and does not poll after
// the next bursts of traffic (SharedProcessor).
//
// Threads  that of the event loop.
#pragma once

#include <cstdint>
#include <kj/async-unix.h>
#include <vector>

#include "router/fatal_tasks.h"
#include "router/poll_budget.h"
#include "shm/shared_processor.h"

namespace mpf::router {

// A window with links.
class Polled {
 public:
  // Handles the messages that are there.
  virtual void poll() = 0;
  // While `isPolled` is true, poll() is called all the time, and messages need not wake the event
  // loop. After a change to false, one more poll() follows.
  virtual void setPolled(bool isPolled) = 0;

 protected:
  ~Polled() = default;
};

class Polling {
 public:
  static constexpr std::size_t kMaxWindows = 8;  // at a time

  explicit Polling(kj::UnixEventPort& port) noexcept : port_(port) {}

  // Messages have arrived or were sent.
  void noteTraffic();
  // As noteTraffic(), and polls this window, too, unless kMaxWindows others are busier.
  void add(Polled& window);
  // Call it after messages were handed over. While this object polls, it yields the processor, so
  // that receivers on the same processor run, and looks at the windows, once in each turn. After a
  // long yield the next turn ends the polling.
  void lookForAnswers();
  // The window is destroyed.
  void remove(Polled& window) noexcept;
  [[nodiscard]] bool isPolling() const noexcept { return isPolling_; }

 private:
  kj::Promise<void> nextTurn();
  kj::Promise<void> loop();
  void pollWindows();
  bool tryYield(std::int64_t nowNs);
  void end();
  static void drop(Polled& window);

  kj::UnixEventPort& port_;
  PollBudget budget_;
  SharedProcessor processor_;
  std::int64_t lastTrafficNs_ = 0;
  std::uint32_t idleTurns_ = 0;  // of the loop, since the last traffic
  bool isPolling_ = false;
  bool hasLooked_ = false;  // for answers, in this turn
  bool isCrowded_ = false;  // others use the processor for long: the next turn ends the polling
  bool isReplacing_ = false;  // add() is dropping the oldest window
  std::vector<Polled*> windows_;  // the one added last is at the end
  FatalTasks tasks_;
};

}  // namespace mpf::router
