// SPDX-License-Identifier: MIT
// LineKeeper: keeps a line open: opens it, and after a loss tries again, ever less often, until it
// is back.
//
//   tryOpen ──► open ──► lost ──► 20 ms ──► tryOpen ──► 40 ms ──► tryOpen ──► ... ──► every second
//                 └─ after a second up, the next loss starts at 20 ms again
//
// Threads  service() and the like on the port's thread; state, reason and wait from any.
// Trust    a far end that accepts and hangs up at once is called back once a second at most.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>

#include <mpf/clock.h>
#include <mpf/drivers/serial/serial_port.h>

#include "drivers/serial/serial_line.h"

namespace mpf {

class LineKeeper {
 public:
  explicit LineKeeper(std::unique_ptr<SerialLine> line) : line_(std::move(line)) {}

  // For the port's thread: what to poll and until when; then service() with what poll said, which
  // opens when it is time.
  [[nodiscard]] pollfd waitsFor() const noexcept;
  [[nodiscard]] Deadline wakeAt() const noexcept;
  void service(short readyEvents);
  // The line is gone: line().problem() says why.
  void lose();
  [[nodiscard]] bool isOpen() const noexcept { return phase_ == Phase::open; }
  [[nodiscard]] SerialLine& line() noexcept { return *line_; }
  [[nodiscard]] const SerialLine& line() const noexcept { return *line_; }

  // For any thread.
  [[nodiscard]] SerialPortState state() const;
  [[nodiscard]] std::string unpluggedBecause() const;
  [[nodiscard]] bool waitForState(SerialPortState state, Deadline deadline) const;
  void onStateChange(StateHandler handler);
  // Waits for the end of the first attempt to open; returns what went wrong, or empty.
  [[nodiscard]] std::string waitForFirstAttempt() const;

 private:
  enum class Phase : std::uint8_t { closed, opening, open };
  void proceed();
  void retryLater(const std::string& reason);
  void publish(SerialPortState state, const std::string& reason);

  std::unique_ptr<SerialLine> line_;
  Phase phase_ = Phase::closed;
  // when closed: the next attempt; when opening: the end of this one
  Deadline attemptAt_ = Deadline::atNs(0);
  Nanoseconds backoff_{};  // before the next attempt
  std::int64_t openedAtNs_ = 0;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  SerialPortState state_ = SerialPortState::unplugged;  // under mutex_
  std::string reason_ = "not opened yet";  // under mutex_
  bool attempted_ = false;  // under mutex_
  StateHandler stateHandler_;  // under mutex_, also while it runs
};

}  // namespace mpf
