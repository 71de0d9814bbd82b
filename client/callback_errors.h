// SPDX-License-Identifier: MIT
// CallbackErrors: writes exceptions of callbacks to stderr when no caller can catch them. Each
// report is one line (wrapped here):
//
//   mpf: the callback of the client of server "dac" at location 0 threw an exception:
//   no such record. The dispatcher continues; catch the exception in the callback.
//   (repeated 41 times in 10.0 s)
//
// A LogLimiter holds back the reports of a callback that throws again and again.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/log_limiter.h"

namespace mpf {

class CallbackErrors {
 public:
  // The client whose callback threw the exception that is reported next.
  void note(const std::string& server, std::int32_t location) noexcept;
  // Reports the exception that is being handled: now, or from dueNs() on.
  void report() noexcept;
  // When writeDue() has something to write; INT64_MAX: no line is held.
  [[nodiscard]] std::int64_t dueNs() const noexcept { return limiter_.dueNs(); }
  void writeDue() noexcept;
  // Writes all held lines. Call it before the thread ends.
  void writeHeld() noexcept;

 private:
  static void write(const std::vector<LogLimiter::Line>& lines);

  std::string client_;
  LogLimiter limiter_;
};

}  // namespace mpf
