// SPDX-License-Identifier: MIT
// afterReadyTasks: resolves when no other task of the event loop is ready, so that what these tasks
// produce can be handled together, but after 1 ms at the latest.
//
// kj::evalLast() has no such limit. The router looks at its descriptors every few tasks
// (kTurnsBetweenPolls in main.cpp), so while many peers send all the time, some tasks are always
// ready, and kj::evalLast() would never resolve.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async.h>
#include <kj/timer.h>

namespace mpf::router {

// Usually the timer is destroyed before it expires: it costs about 0.3 us, and no wake-up.
[[nodiscard]] inline kj::Promise<void> afterReadyTasks(kj::Timer& timer) {
  constexpr auto kLatest = 1 * kj::MILLISECONDS;
  return kj::evalLast([] {}).exclusiveJoin(timer.afterDelay(kLatest));
}

}  // namespace mpf::router
