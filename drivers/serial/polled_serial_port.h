// SPDX-License-Identifier: MIT
// PolledSerialPort: the SerialPort for all kinds of SerialLine. One thread polls the line and makes
// all calls to it.
//
//   poll(tasks, line, next deadline)
//     ├─ tasks    begin a request, bind, release, configure
//     ├─ line     open ── send unsent bytes ── receive ── taps, byte handler
//     └─ time     end a request whose deadline has passed, try to open the line
//
// Because one thread sends, receives and calls the taps, taps see the bytes in the order of the
// line, and a request needs no lock.
//
// Threads  the port's thread, with all signals blocked. Callers wait for it; it never waits for
//          them.
// Crash    nothing here survives the process.
// Trust    see SerialPort.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <mpf/drivers/serial/serial_port.h>

#include "drivers/serial/line_keeper.h"
#include "drivers/serial/port_tasks.h"

namespace mpf {

class PolledSerialPort : public SerialPort {
 public:
  // Starts the port's thread, which opens `line`.
  //   mayBeAbsent  true: the constructor returns at once, and the port is unplugged until the line
  //                could be opened; false: the constructor waits for the first attempt
  //   throws       std::runtime_error, unless mayBeAbsent is set, when the first attempt fails:
  //                what() is SerialLine::problem(); std::system_error when no descriptor or thread
  //                can be created
  PolledSerialPort(std::unique_ptr<SerialLine> line, bool mayBeAbsent);
  // Ends an outstanding request with failure.
  ~PolledSerialPort() override;

  void bind(ByteHandler& handler) override;
  void release() override;
  void abandonWhen(std::function<bool()> isAbandoned) override {
    isAbandoned_ = std::move(isAbandoned);
  }
  SerialPortStatus sendBreak(Milliseconds duration) override;
  [[nodiscard]] SerialPortStatus getStatus() const noexcept override;
  [[nodiscard]] std::string config(const SerialSettings& settings) override;
  [[nodiscard]] SerialPortCounters counters() const noexcept override;
  [[nodiscard]] SerialPortState state() const override { return keeper_.state(); }
  [[nodiscard]] std::string unpluggedBecause() const override { return keeper_.unpluggedBecause(); }
  [[nodiscard]] bool waitForState(SerialPortState state, Deadline deadline) const override {
    return keeper_.waitForState(state, deadline);
  }
  void onStateChange(StateHandler handler) override { keeper_.onStateChange(std::move(handler)); }
  [[nodiscard]] std::string description() const override { return keeper_.line().description(); }

 protected:
  SerialPortStatus transfer(Bytes data, bool wantsRead, Deadline deadline) override;

 private:
  // The outstanding request, in the stack frame of its caller.
  struct Request {
    Bytes unsent;
    bool hasSent = false;  // the line has accepted at least one byte
    bool awaitsAnswer = false;
    bool awaitsIdleLine = false;  // waits until all bytes have left the queue of the line
    bool isBreak = false;
    Deadline deadline;
    SerialPortStatus status = SerialPortStatus::failure;
    bool done = false;
  };
  // Written by the port's thread.
  struct Counters {
    std::atomic<std::uint64_t> bytesIn, bytesOut, timeouts, failures, overruns, parityErrors,
        framingErrors, breaks, unplugs;
  };

  void run(const std::stop_token& stop);
  void poll();
  [[nodiscard]] Deadline wakeAt() const;
  SerialPortStatus execute(Request& request);
  void begin(Request& request);
  void advance();
  void send();
  void receive();
  void receiveAll();
  void abandon(const Request& request);
  void deliver(const LineByte& byte);
  void takeOverruns();
  void fail(LineFault fault, std::uint64_t count);
  void act(ByteHandlerResult result);
  void endRead(SerialPortStatus status);
  void end(SerialPortStatus status);
  void loseLine();
  void countFault(LineFault fault);
  void show(ByteDirection direction, std::span<const LineByte> bytes) const;

  std::function<bool()> isAbandoned_;  // used by the binder's threads
  PortTasks tasks_;
  LineKeeper keeper_;
  // used by the port's thread only:
  ByteHandler* handler_ = nullptr;
  Request* request_ = nullptr;
  std::vector<LineByte> received_;
  // overruns that are counted but not yet reported, because the byte after the gap follows
  std::uint64_t unreportedOverruns_ = 0;
  Counters counters_{};
  std::atomic<SerialPortStatus> status_{SerialPortStatus::success};
  std::jthread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
