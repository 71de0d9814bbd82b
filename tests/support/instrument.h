// SPDX-License-Identifier: MIT
// Instrument: answers SCPI-like commands at the far end of a line, and misbehaves on request.
//
//   *IDN?         MPF,INSTRUMENT,0,1.0
//   MEAS:VOLT?    1.234
//   ECHO <text>   <text>
//   other text    no answer
//
// Commands end with \n or \r\n, answers end with answerEnd.
//
//   Instrument instrument("/tmp/test/ttyA");        // on a pseudo-terminal, or connect() a socket
//   instrument.behave({.delay = 20ms, .noise = "\x07"});
//
// Threads  any thread may call; the instrument has a thread of its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <mpf/file_descriptor.h>

#include "tests/support/pty.h"

namespace mpf::test {

// How the instrument answers a command.
struct Behaviour {
  std::chrono::milliseconds delay{0};  // before the answer
  // If set, the answer is sent byte by byte, with this pause between bytes.
  std::optional<std::chrono::milliseconds> gap = std::nullopt;
  std::string noise = {};  // bytes before the answer
  bool isSilent = false;  // no answer at all
  std::string answerEnd = "\r\n";
};

class Instrument {
 public:
  // An instrument that is not connected to a line.
  Instrument();
  // An instrument on a pseudo-terminal that a port opens at `linkPath`.
  explicit Instrument(std::string linkPath);
  ~Instrument();
  Instrument(const Instrument&) = delete;
  Instrument& operator=(const Instrument&) = delete;

  // Sets how later commands are answered.
  void behave(Behaviour behaviour);
  // Sends `text` at once, unchanged.
  void say(std::string_view text);

  // Serves `line`, a socket for example, until unplug().
  void connect(FileDescriptor line);
  // Hangs up. Bytes that have not been sent are lost.
  void unplug();
  // A new pseudo-terminal at the same path.
  void plugIn();

  // Waits until all bytes received since the start contain `text`. Returns false if the watchdog
  // expires.
  [[nodiscard]] bool waitForReceived(std::string_view text) const;
  [[nodiscard]] std::string received() const;
  // The settings of the pseudo-terminal.
  [[nodiscard]] termios settings() const;
  // Stops reading, as a device that uses its flow control line, or continues to read.
  void setReading(bool isReading);

 private:
  using Clock = std::chrono::steady_clock;
  struct Output {
    Clock::time_point at;
    std::string text;
  };
  void run(const std::stop_token& stop);
  [[nodiscard]] int descriptor() const;  // this and the next: called with mutex_ locked
  [[nodiscard]] int msToNextOutput() const;
  void receive();
  void execute(std::string_view command);
  void answer(const std::string& text);
  void sendDue();
  void send(std::string_view text);
  void hangUp();
  void wake() const noexcept;

  FileDescriptor bell_;
  std::string linkPath_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::unique_ptr<Pty> pty_;  // all below under mutex_
  FileDescriptor line_;
  Behaviour behaviour_;
  bool isReading_ = true;
  std::string received_;
  std::string command_;  // the part of the next command that has been received
  std::vector<Output> outputs_;
  std::jthread thread_;
};

}  // namespace mpf::test
