// SPDX-License-Identifier: MIT
#include "router/polling.h"

#include <sched.h>

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

kj::Promise<void> Polling::loop() {
  if (Clock::nowNs() - lastTrafficNs_ >= budget_.ns()) {
    isPolling_ = false;
    return kj::READY_NOW;
  }
  ++idleTurns_;
  ::sched_yield();
  port_.poll();
  return kj::evalLast([this] { return loop(); });
}

}  // namespace mpf::router
