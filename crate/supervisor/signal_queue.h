// SPDX-License-Identifier: MIT
// SignalQueue: signals as events of a poll() loop. While the object exists, they are blocked.
//
// Threads  one; threads that are started later inherit the blocked signals.
#pragma once

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <initializer_list>
#include <optional>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::crate {

class SignalQueue {
 public:
  SignalQueue(std::initializer_list<int> numbers) {
    sigset_t signals;
    ::sigemptyset(&signals);
    for (const int one : numbers) ::sigaddset(&signals, one);
    ::sigprocmask(SIG_BLOCK, &signals, &before_);
    queue_ =
        FileDescriptor(checkCall(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK), "signalfd"));
  }
  ~SignalQueue() { ::sigprocmask(SIG_SETMASK, &before_, nullptr); }
  SignalQueue(const SignalQueue&) = delete;
  SignalQueue& operator=(const SignalQueue&) = delete;

  // Readable while a signal is queued.
  [[nodiscard]] int descriptor() const noexcept { return queue_.get(); }
  // The number of the next signal. Signals of one number may be merged.
  [[nodiscard]] std::optional<int> take() const {
    signalfd_siginfo one{};
    if (::read(queue_.get(), &one, sizeof one) != sizeof one) return std::nullopt;
    return static_cast<int>(one.ssi_signo);
  }

 private:
  FileDescriptor queue_;
  sigset_t before_{};
};

}  // namespace mpf::crate
