// SPDX-License-Identifier: MIT
// FatalTasks: what runs on the event loop and is to go on for as long as its owner. An exception
// that it lets through ends the program: without it the router would seem to live, and be deaf in
// one ear.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async.h>

namespace mpf::router {

class FatalTasks final : private kj::TaskSet::ErrorHandler {
 public:
  FatalTasks() : tasks_(*this) {}
  void add(kj::Promise<void> task) { tasks_.add(kj::mv(task)); }

 private:
  void taskFailed(kj::Exception&& error) override { kj::throwFatalException(kj::mv(error)); }

  kj::TaskSet tasks_;
};

}  // namespace mpf::router
