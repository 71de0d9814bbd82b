// SPDX-License-Identifier: MIT
// Alarm: calls back once at a time, the earliest that it was set to. It may be set again from
// within: a kj promise that replaced itself while it runs would be an error.
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
    if (!pending_.insert(dueNs_).second) return;  // from before an earlier time was set
    tasks_.add(timer_.afterDelay(toKj(due.left())).then([this, ns = dueNs_] {
      pending_.erase(ns);
      if (ns != dueNs_) return;  // it was set to an earlier time, which has been
      dueNs_ = kNever;
      callback_();
    }));
  }

 private:
  static constexpr std::int64_t kNever = INT64_MAX;

  kj::Timer& timer_;
  std::function<void()> callback_;
  std::int64_t dueNs_ = kNever;
  std::set<std::int64_t> pending_;  // times for which there is a task
  FatalTasks tasks_;
};

}  // namespace mpf::router
