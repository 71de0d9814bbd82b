// SPDX-License-Identifier: MIT
// StopBell: waits for SIGINT or SIGTERM. A signal that was received after the construction of the
// object also ends the wait.
//
//   StopBell stop;                     // from here on no signal is lost
//   ...start threads, open windows...
//   stop.wait();
//
// Threads  one thread waits. After a signal every further wait returns at once.
#pragma once

#include <poll.h>
#include <sys/eventfd.h>

#include <chrono>

#include <mpf/file_descriptor.h>

#include "base/stop_signals.h"
#include "base/system_call.h"

namespace mpf {

class StopBell {
 public:
  //   throws  std::system_error, and the exceptions of StopSignals
  StopBell()
      : bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", "for signals")),
        signals_(ring, &bell_) {}

  void wait() noexcept { static_cast<void>(poll(-1)); }
  // Returns true if a signal was received within `longest`.
  [[nodiscard]] bool wait(std::chrono::milliseconds longest) noexcept {
    return poll(static_cast<int>(longest.count()));
  }

 private:
  static void ring(void* bell) noexcept {
    ::eventfd_write(static_cast<FileDescriptor*>(bell)->get(), 1);
  }
  // A handler that runs in this thread interrupts poll() and makes the descriptor readable.
  [[nodiscard]] bool poll(int milliseconds) noexcept {
    pollfd rung{.fd = bell_.get(), .events = POLLIN, .revents = 0};
    return retryInterrupted([&] { return ::poll(&rung, 1, milliseconds); }) > 0;
  }

  FileDescriptor bell_;
  StopSignals signals_;
};

}  // namespace mpf
