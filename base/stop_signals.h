// SPDX-License-Identifier: MIT
// StopSignals: calls a callback at each SIGINT and SIGTERM while the object exists. Several objects
// may exist at once, in any threads.
//
// Threads  the callback runs in the thread that the kernel chooses for the signal. The destructor
//          waits until no thread executes the callback.
#pragma once

namespace mpf {

class StopSignals {
 public:
  using Callback = void (*)(void* argument) noexcept;  // async-signal-safe

  // Throws std::runtime_error if the process already has 64 of these objects.
  StopSignals(Callback callback, void* argument);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  unsigned slot_;
};

}  // namespace mpf
