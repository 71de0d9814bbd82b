// SPDX-License-Identifier: MIT
#include "router/polling.h"

#include <sched.h>

#include <algorithm>
#include <kj/common.h>
#include <utility>

#include <mpf/clock.h>

#include "router/after_ready_tasks.h"

namespace mpf::router {
namespace {

// The writes that follow a read belong to the same burst: there was no wait between them.
constexpr std::uint32_t kTurnsOfWait = 2;

}  // namespace

void Polling::noteTraffic() {
  const auto nowNs = Clock::nowNs();
  if (idleTurns_ >= kTurnsOfWait || !isPolling_) budget_.noteWait(nowNs - lastTrafficNs_);
  lastTrafficNs_ = nowNs;
  idleTurns_ = 0;
  if (isPolling_ || processor_.plan() == SharedProcessor::Plan::keep) return;
  isPolling_ = true;
  tasks_.add(nextTurn());
}

void Polling::add(Polled& window) {
  noteTraffic();
  // A window that is not added wakes the event loop by its descriptor. While add() drops the oldest
  // window, that window's last poll() may call add().
  if (!isPolling_ || isReplacing_) return;
  if (!windows_.empty() && windows_.back() == &window) return;
  if (const auto found = std::ranges::find(windows_, &window); found != windows_.end()) {
    std::rotate(found, found + 1, windows_.end());
    return;
  }
  if (windows_.size() == kMaxWindows) {
    auto& oldest = *windows_.front();
    windows_.erase(windows_.begin());
    isReplacing_ = true;
    KJ_DEFER(isReplacing_ = false);
    drop(oldest);
  }
  windows_.push_back(&window);
  window.setPolled(true);
}

void Polling::remove(Polled& window) noexcept { std::erase(windows_, &window); }

void Polling::drop(Polled& window) {
  window.setPolled(false);
  window.poll();
}

// afterDelay(0): the event loop first runs all tasks that are ready and looks at its descriptors.
// afterReadyTasks(): the turn runs after the handlers of what the descriptors have brought. Of the
// calls of afterReadyTasks() the newest one resolves first: writes to the lines, which are newer,
// run before the turn.
kj::Promise<void> Polling::nextTurn() {
  auto& timer = port_.getTimer();
  return timer.afterDelay(0 * kj::NANOSECONDS)
      .then([&timer] { return afterReadyTasks(timer); })
      .then([this] { return loop(); });
}

kj::Promise<void> Polling::loop() {
  const auto nowNs = Clock::nowNs();
  ++idleTurns_;
  hasLooked_ = false;
  if (nowNs - lastTrafficNs_ >= budget_.ns() || isCrowded_ || !tryYield(nowNs)) {
    end();
    return kj::READY_NOW;
  }
  pollWindows();
  return nextTurn();
}

void Polling::lookForAnswers() {
  if (!isPolling_ || std::exchange(hasLooked_, true)) return;
  isCrowded_ = !tryYield(Clock::nowNs());
  // An error of a window does not concern the line that calls.
  tasks_.add(kj::evalNow([this]() -> kj::Promise<void> {
    pollWindows();
    return kj::READY_NOW;
  }));
}

void Polling::pollWindows() {
  // NOLINTNEXTLINE(modernize-loop-convert): the call may add or remove a window
  for (std::size_t at = 0; at < windows_.size(); ++at) windows_[at]->poll();
}

// Returns false if others use the processor for long: then a wake-up is earlier than the next turn.
bool Polling::tryYield(std::int64_t nowNs) {
  ::sched_yield();
  const auto yieldNs = Clock::nowNs() - nowNs;
  processor_.noteYield(yieldNs, true);  // true: PollBudget ends polling that brings nothing
  return !SharedProcessor::isLong(yieldNs);
}

// The last look at the windows may start to poll them again, or remove others.
void Polling::end() {
  isPolling_ = false;
  hasLooked_ = isCrowded_ = false;
  for (auto left = windows_.size(); left != 0 && !windows_.empty(); --left) {
    auto& window = *windows_.front();
    windows_.erase(windows_.begin());
    drop(window);
  }
}

}  // namespace mpf::router
