// SPDX-License-Identifier: MIT
// StopSignals: while it lives, SIGINT and SIGTERM call back. Several may live at once, in any
// threads.
//
// Threads  the callback runs in whatever thread the kernel chose for the signal. The destructor
//          waits until it runs in none.
#pragma once

namespace mpf {

class StopSignals {
 public:
  using Callback = void (*)(void* argument) noexcept;  // async-signal-safe

  // Throws std::runtime_error when 64 live already.
  StopSignals(Callback callback, void* argument);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  unsigned slot_;
};

}  // namespace mpf
