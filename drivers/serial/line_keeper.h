// SPDX-License-Identifier: MIT
// LineKeeper: keeps a line open. It opens the line, and after a loss opens it again; the pause
// between two attempts grows from 20 ms to one second.
//
//   tryOpen ──► open ──► lost ──► 20 ms ──► tryOpen ──► 40 ms ──► tryOpen ──► ... ──► every second
//                 └─ after more than a second in this state, the next pause is 20 ms again
//
// Threads  the functions for the port's thread are marked; any thread may call the others.
// Trust    a far end that accepts each connection and closes it at once causes at most one attempt
//          each second, after the first few.
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

  // --- for the port's thread
  // What to poll, and until when. Then call service() with the events that poll() returned; it
  // opens the line when an attempt is due.
  [[nodiscard]] pollfd waitsFor() const noexcept;
  [[nodiscard]] Deadline wakeAt() const noexcept;
  void service(short readyEvents);
  // Closes the line and schedules the next attempt. Call it when the line is lost; line().problem()
  // says why.
  void lose();
  [[nodiscard]] bool isOpen() const noexcept { return phase_ == Phase::open; }
  [[nodiscard]] SerialLine& line() noexcept { return *line_; }
  [[nodiscard]] const SerialLine& line() const noexcept { return *line_; }

  // --- for any thread; see SerialPort
  [[nodiscard]] SerialPortState state() const;
  [[nodiscard]] std::string unpluggedBecause() const;
  [[nodiscard]] bool waitForState(SerialPortState state, Deadline deadline) const;
  void onStateChange(StateHandler handler);
  // Waits for the end of the first attempt to open. Returns why it failed; empty when it succeeded.
  [[nodiscard]] std::string waitForFirstAttempt() const;

 private:
  enum class Phase : std::uint8_t { closed, opening, open };
  void proceed();
  void retryLater(const std::string& reason);
  void publish(SerialPortState state, const std::string& reason);

  std::unique_ptr<SerialLine> line_;
  Phase phase_ = Phase::closed;
  // when closed: the time of the next attempt; when opening: the end of this attempt
  Deadline attemptAt_ = Deadline::atNs(0);
  Nanoseconds backoff_{};  // the last pause between two attempts
  std::int64_t openedAtNs_ = 0;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  SerialPortState state_ = SerialPortState::unplugged;  // under mutex_
  std::string reason_ = "not opened yet";  // under mutex_
  bool attempted_ = false;  // under mutex_
  StateHandler stateHandler_;  // under mutex_, also while it runs
};

}  // namespace mpf
