// SPDX-License-Identifier: MIT
// StopBell: waits for SIGINT or SIGTERM, those included that came since it was made.
//
//   StopBell stop;                     // from here on a signal is not lost
//   ...start all that is to run...
//   stop.wait();
//
// Threads  one waits. It stays rung.
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
  //   throws  std::system_error, and as StopSignals
  StopBell()
      : bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", "for signals")),
        signals_(ring, &bell_) {}

  void wait() noexcept { static_cast<void>(poll(-1)); }
  // Whether it rang by then.
  [[nodiscard]] bool wait(std::chrono::milliseconds longest) noexcept {
    return poll(static_cast<int>(longest.count()));
  }

 private:
  static void ring(void* bell) noexcept {
    ::eventfd_write(static_cast<FileDescriptor*>(bell)->get(), 1);
  }
  // A handler that ran in this thread has interrupted it, and rung.
  [[nodiscard]] bool poll(int milliseconds) noexcept {
    pollfd rung{.fd = bell_.get(), .events = POLLIN, .revents = 0};
    return retryInterrupted([&] { return ::poll(&rung, 1, milliseconds); }) > 0;
  }

  FileDescriptor bell_;
  StopSignals signals_;
};

}  // namespace mpf
