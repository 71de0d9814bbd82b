// SPDX-License-Identifier: MIT
// BusyTasks: while it exists, a task of the event loop is always ready, as in a router to which
// many peers send all the time.
//
// Threads  one, with its event loop.
#pragma once

#include <kj/async-io.h>

namespace mpf::test {

class BusyTasks {
 public:
  explicit BusyTasks(kj::AsyncIoContext& io) : task_(run().eagerlyEvaluate(nullptr)) {
    io.waitScope.setBusyPollInterval(32);  // as in the router
  }

 private:
  static kj::Promise<void> run() {
    return kj::evalLater([] { return run(); });
  }

  kj::Promise<void> task_;
};

}  // namespace mpf::test
