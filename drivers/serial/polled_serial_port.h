// SPDX-License-Identifier: MIT
// PolledSerialPort: what is the same for all ports: one thread that polls the line and does
// everything with it.
//
//   poll(tasks, line, next deadline)
//     ├─ tasks    begin a request, bind, release, configure
//     ├─ line     open ── send what is left ── receive ── taps, byte handler
//     └─ time     requests that are late, attempts to open
//
// Because one thread sends, receives and shows, taps see bytes in the order of the line, and a
// request needs no lock.
//
// Threads  the port's own, with all signals blocked; callers wait for it, and it waits for none of
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
  // Opens `line`.
  //   mayComeLater  when it cannot be opened: true waits for it, unplugged, and returns at once;
  //                 false throws
  //   throws        std::runtime_error that names the call, the object and the reason
  PolledSerialPort(std::unique_ptr<SerialLine> line, bool mayComeLater);
  // Ends a request that is outstanding with failure.
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
  // The request that is outstanding; lives in its caller's frame.
  struct Request {
    Bytes unsent;
    bool hasSent = false;  // the kernel took some of it
    bool awaitsAnswer = false;
    bool awaitsIdleLine = false;  // all bytes out of the kernel's queue
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

  std::function<bool()> isAbandoned_;  // the binder's threads
  PortTasks tasks_;
  LineKeeper keeper_;
  ByteHandler* handler_ = nullptr;  // this and below: the port's thread
  Request* request_ = nullptr;
  std::vector<LineByte> received_;
  std::uint64_t overrunsToTell_ = 0;  // counted; the byte after the gap has not been delivered yet
  Counters counters_{};
  std::atomic<SerialPortStatus> status_{SerialPortStatus::success};
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace mpf
