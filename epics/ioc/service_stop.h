// SPDX-License-Identifier: MIT
// ServiceStop: ends `mpf-ioc -S` at SIGINT or SIGTERM: cleanly if the IOC has started, or starts
// within a few seconds; otherwise at once, because a startup file may wait for ever, and EPICS
// suspends a thread that cannot proceed.
//
// Threads  one calls wait(). A thread of its own waits for the signal.
#pragma once

#include <future>

#include "base/stop_bell.h"

namespace mpf {

class ServiceStop {
 public:
  // It must live until the program ends.
  ServiceStop();
  // The IOC has started: returns after a signal.
  void wait();

 private:
  void watch() noexcept;

  StopBell bell_;
  std::promise<void> started_, stopped_;
};

}  // namespace mpf
