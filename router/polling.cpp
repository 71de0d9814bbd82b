// SPDX-License-Identifier: MIT
#include "router/polling.h"

#include <sched.h>

#include <utility>

#include <mpf/clock.h>

#include "router/after_ready_tasks.h"

namespace mpf::router {
namespace {

// After fewer idle turns, traffic belongs to the same burst, for example the write after a read.
constexpr std::uint32_t kTurnsOfWait = 2;

}  // namespace

void Polling::noteTraffic() {
  const auto nowNs = Clock::nowNs();
  if (idleTurns_ >= kTurnsOfWait || !isPolling_) budget_.noteWait(nowNs - lastTrafficNs_);
  lastTrafficNs_ = nowNs;
  idleTurns_ = 0;
  if (isPolling_ || processor_.plan() == SharedProcessor::Plan::keep) return;
  isPolling_ = true;
  writes_.setDriven(true);
  tasks_.add(nextTurn());
}

void Polling::remove(Polled& polled) noexcept {
  lines_.remove(polled);
  windows_.remove(polled);
}

// afterDelay(0): the event loop first runs all tasks that are ready, among them the writes that
// were due when the polling began, and looks at its descriptors. afterReadyTasks(): the turn runs
// after the handlers of what the descriptors have brought.
kj::Promise<void> Polling::nextTurn() {
  auto& timer = port_.getTimer();
  return timer.afterDelay(0 * kj::NANOSECONDS)
      .then([&timer] { return afterReadyTasks(timer); })
      .then([this] { return loop(); });
}

kj::Promise<void> Polling::loop() {
  writes_.run();  // before others get the processor
  const auto nowNs = Clock::nowNs();
  ++idleTurns_;
  hasLooked_ = false;
  if (nowNs - lastTrafficNs_ >= budget_.ns() || isCrowded_ || !tryYield(nowNs)) {
    end();
    return kj::READY_NOW;
  }
  lines_.poll();
  windows_.poll();
  writes_.run();
  return nextTurn();
}

void Polling::lookForAnswers() {
  if (!isPolling_ || std::exchange(hasLooked_, true)) return;
  isCrowded_ = !tryYield(Clock::nowNs());
  // evalNow: an exception ends the router (FatalTasks), not the line that calls.
  tasks_.add(kj::evalNow([this]() -> kj::Promise<void> {
    windows_.poll();
    writes_.run();
    return kj::READY_NOW;
  }));
}

// Returns false if others use the processor for long: then a wake-up is earlier than the next turn.
bool Polling::tryYield(std::int64_t nowNs) {
  ::sched_yield();
  const auto yieldNs = Clock::nowNs() - nowNs;
  processor_.noteYield(yieldNs, true);  // true: PollBudget ends polling that brings nothing
  return !SharedProcessor::isLong(yieldNs);
}

void Polling::end() {
  isPolling_ = false;
  hasLooked_ = isCrowded_ = false;
  lines_.clear();
  windows_.clear();
  // The last poll() of a window may have called noteTraffic().
  writes_.setDriven(isPolling_);
}

}  // namespace mpf::router
