// SPDX-License-Identifier: MIT
// FatalTasks: tasks of the event loop that run as long as their owner exists. An exception from a
// task ends the program, because a router without this task would appear to work but ignore some
// events.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async.h>

namespace mpf::router {

class FatalTasks final : private kj::TaskSet::ErrorHandler {
 public:
  FatalTasks() : tasks_(*this) {}
  void add(kj::Promise<void> task) { tasks_.add(kj::mv(task)); }
  // Resolves when no task is left. Only one such promise may exist.
  [[nodiscard]] kj::Promise<void> onEmpty() { return tasks_.onEmpty(); }

 private:
  void taskFailed(kj::Exception&& error) override { kj::throwFatalException(kj::mv(error)); }

  kj::TaskSet tasks_;
};

}  // namespace mpf::router
