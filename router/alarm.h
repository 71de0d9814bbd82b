// SPDX-License-Identifier: MIT
// Alarm: calls back once, at the earliest of the times that it was set to. The callback may set it
// again, which a single kj promise does not permit: a promise must not replace itself while it
// runs.
//
// Threads  that of the event loop.
#pragma once

#include <cstdint>
#include <functional>
#include <kj/timer.h>
#include <set>

#include <mpf/clock.h>

#include "router/fatal_tasks.h"
#include "router/transport/kj_text.h"

namespace mpf::router {

class Alarm {
 public:
  Alarm(kj::Timer& timer, std::function<void()> callback)
      : timer_(timer), callback_(std::move(callback)) {}

  void setAt(Deadline due) {
    if (due.ns() >= dueNs_) return;
    dueNs_ = due.ns();
    if (!pending_.insert(dueNs_).second) return;  // a task for this time still exists
    tasks_.add(timer_.afterDelay(toKj(due.left())).then([this, ns = dueNs_] {
      pending_.erase(ns);
      if (ns != dueNs_) return;  // it was set to an earlier time, which has passed
      dueNs_ = kNever;
      callback_();
    }));
  }

 private:
  static constexpr std::int64_t kNever = INT64_MAX;

  kj::Timer& timer_;
  std::function<void()> callback_;
  std::int64_t dueNs_ = kNever;
  std::set<std::int64_t> pending_;  // times for which a task exists
  FatalTasks tasks_;
};

}  // namespace mpf::router
