// SPDX-License-Identifier: MIT
#include "router/polling.h"

#include <sched.h>

#include <algorithm>
#include <utility>

#include <mpf/clock.h>

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
  if (std::exchange(isPolling_, true)) return;
  tasks_.add(kj::evalLast([this] { return loop(); }));
}

void Polling::add(Polled& window) {
  noteTraffic();
  if (!windows_.empty() && windows_.back() == &window) return;
  if (const auto found = std::ranges::find(windows_, &window); found != windows_.end()) {
    std::rotate(found, found + 1, windows_.end());
    return;
  }
  if (windows_.size() == kMaxWindows) {
    auto& oldest = *windows_.front();
    windows_.erase(windows_.begin());
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

kj::Promise<void> Polling::loop() {
  if (Clock::nowNs() - lastTrafficNs_ >= budget_.ns()) {
    end();
    return kj::READY_NOW;
  }
  ++idleTurns_;
  ::sched_yield();
  // Of the tasks of evalLast(), the loop runs the newest one first. So the next turn is created
  // before the calls below create tasks that write to the lines, which must run before it.
  auto next = kj::evalLast([this] { return loop(); }).eagerlyEvaluate(nullptr);
  // A window may be added or removed by the call.
  for (std::size_t at = 0; at < windows_.size(); ++at) windows_[at]->poll();
  port_.poll();
  return next;
}

// The last look at the windows may start to poll them again.
void Polling::end() {
  isPolling_ = false;
  for (auto* window : std::exchange(windows_, {})) drop(*window);
}

}  // namespace mpf::router
