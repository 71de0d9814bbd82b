// SPDX-License-Identifier: MIT
// SerialPort: a serial line of any kind (manual, "SerialPort").
//
//   PosixTerminalPort port({.device = "/dev/ttyS0", .settings = {.baud = 9600, .stopBits = 1,
//   .bitsPerChar = 8, .parity = 'N'}}); BoundSerialPort line(port, handler);                 //
//   handler: a ByteHandler, gets each byte from now on if (line->writeRead(command, 500ms) ==
//   SerialPortStatus::success) use(handler.answer());
//
//   binder's thread     write, read, writeRead ──┐                        ┌──► taps          every byte, both directions
//                                                ├──► the port's thread ──┤
//   the line            bytes, faults, unplug ───┘                        └──► byte handler  every byte received
//
// Threads  any. One request at a time: a second one at the same time fails. release(), config(),
//          taps, counters and state may be called beside it. Handlers run on the port's thread, one
//          at a time; they must not block, throw or call the port.
// Crash    nothing here survives the process; the kernel frees the line.
// Trust    the far end may send anything, at any time, or go away: that costs requests, never a
//          hang.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include <mpf/clock.h>
#include <mpf/drivers/serial/peek_taps.h>
#include <mpf/drivers/serial/serial_settings.h>

namespace mpf {

// How a request ended. failure: a line fault, an unplug, a release, or the byte handler said so.
enum class SerialPortStatus : std::uint8_t { success, timeout, failure };
enum class SerialPortState : std::uint8_t { unplugged, plugged };
// What a byte means for the read that is outstanding, if there is one: go on, end it with success,
// end it with failure.
enum class ByteHandlerResult : std::uint8_t { ok, endRead, error };

[[nodiscard]] const char* toString(SerialPortStatus status) noexcept;
[[nodiscard]] const char* toString(SerialPortState state) noexcept;

// What a binder does with the bytes that come. Once the request has returned, what readEnds() put
// aside is safe to look at; bytes that come meanwhile go to byteReceived() as ever.
class ByteHandler {
 public:
  virtual ~ByteHandler() = default;
  // For each byte received, also when no read is outstanding. Bytes that the line damaged are not
  // passed: they end the read with failure, and so do bytes that got lost; see lineFailed().
  [[nodiscard]] virtual ByteHandlerResult byteReceived(std::uint8_t byte) = 0;
  // A read begins; what had come before has been passed, and nothing of the request is sent yet.
  // endRead: what is kept already satisfies it. error: the read fails, and nothing is sent.
  [[nodiscard]] virtual ByteHandlerResult readBegins() { return ByteHandlerResult::ok; }
  // The kernel has taken the first byte of a writeRead(); bytes passed from here on arrived after
  // that.
  virtual void sendBegins() {}
  // Bytes may be missing between the ones passed before this call and the ones passed after it,
  // also when no read is outstanding. A read that is outstanding ends with failure right after this
  // call.
  //   fault  what happened; never none
  //   count  bytes or breaks that counters() counts for it; 0: one more place where bytes that are
  //          counted already may be missing
  virtual void lineFailed(LineFault /*fault*/, std::uint64_t /*count*/) {}
  // That read is over; bytes that come from here on belong to none.
  virtual void readEnds(SerialPortStatus /*status*/) {}
};

// Told what state the line has come into, and why when that is unplugged. Runs on the port's
// thread; must not block, throw or call the port.
using StateHandler = std::function<void(SerialPortState state, const std::string& because)>;

struct SerialPortCounters {
  std::uint64_t bytesIn = 0;
  std::uint64_t bytesOut = 0;
  std::uint64_t timeouts = 0;  // requests
  std::uint64_t failures = 0;  // requests
  // bytes lost before the kernel or in it, where the driver counts them
  std::uint64_t overruns = 0;
  std::uint64_t parityErrors = 0;  // bytes
  std::uint64_t framingErrors = 0;  // bytes
  std::uint64_t breaks = 0;  // received
  std::uint64_t unplugs = 0;
};

class SerialPort {
 public:
  using Bytes = std::span<const std::uint8_t>;
  using Milliseconds = std::chrono::milliseconds;

  SerialPort() = default;
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  virtual ~SerialPort() = default;

  // One binder at a time: `handler` gets each byte received from now on, and must live until
  // release().
  //   throws  std::runtime_error when the port is bound already
  virtual void bind(ByteHandler& handler) = 0;
  // Ends a request that is outstanding with failure. After return the handler is not called any
  // more.
  virtual void release() = 0;

  // Sends, receives, or both; then receiving is enabled before the first byte is sent, and the
  // answer may end the request before the line is idle. A write has succeeded when the bytes have
  // left the kernel's queue, as far as the line can tell; what it could not send in time is
  // discarded.
  //   timeout  for the whole request. 0: at once, with what has come; a write then succeeds when
  //            the kernel takes all bytes.
  //   returns  failure at once while the line is unplugged or nobody is bound
  SerialPortStatus write(Bytes data, Milliseconds timeout) {
    return write(data, deadlineAfter(timeout));
  }
  SerialPortStatus read(Milliseconds timeout) { return read(deadlineAfter(timeout)); }
  SerialPortStatus writeRead(Bytes data, Milliseconds timeout) {
    return writeRead(data, deadlineAfter(timeout));
  }
  // The same with a deadline that began earlier (manual, "clientStartIoTimeout").
  SerialPortStatus write(Bytes data, Deadline deadline) { return transfer(data, false, deadline); }
  SerialPortStatus read(Deadline deadline) { return transfer({}, true, deadline); }
  SerialPortStatus writeRead(Bytes data, Deadline deadline) {
    return transfer(data, true, deadline);
  }
  // The thread that waits for a request asks `isAbandoned` every 20 ms; true ends the request with
  // failure. Empty: wait on. For the binder, between requests.
  virtual void abandonWhen(std::function<bool()> isAbandoned) = 0;
  // Holds the line in the break state. Fails where the line cannot.
  virtual SerialPortStatus sendBreak(Milliseconds duration) = 0;
  // How the last request ended.
  [[nodiscard]] virtual SerialPortStatus getStatus() const noexcept = 0;

  // Changes the line's settings, all or none.
  //   returns  empty, or a sentence that names the value that this line does not accept
  [[nodiscard]] virtual std::string config(const SerialSettings& settings) = 0;

  // Lets `handler` see every byte that is sent or received, as long as the PeekTap lives.
  [[nodiscard]] PeekTap attachTap(PeekHandler handler) { return taps_->attach(std::move(handler)); }

  [[nodiscard]] virtual SerialPortCounters counters() const noexcept = 0;
  [[nodiscard]] virtual SerialPortState state() const = 0;
  // Why the line is unplugged, in words; empty when it is plugged.
  [[nodiscard]] virtual std::string unpluggedBecause() const = 0;
  // Returns whether the port came into that state before the deadline.
  [[nodiscard]] virtual bool waitForState(SerialPortState state, Deadline deadline) const = 0;
  // Tells `handler` each change of state from now on, instead of the one before, which after return
  // does not run any more. Empty: nobody.
  virtual void onStateChange(StateHandler handler) = 0;
  // The device or the address, for messages to people.
  [[nodiscard]] virtual std::string description() const = 0;

 protected:
  virtual SerialPortStatus transfer(Bytes data, bool wantsRead, Deadline deadline) = 0;
  [[nodiscard]] const PeekTaps& taps() const noexcept { return *taps_; }
  // Unlike Deadline::after() it takes any number of milliseconds, as messages bring them.
  [[nodiscard]] static Deadline deadlineAfter(Milliseconds timeout) noexcept;

 private:
  std::shared_ptr<PeekTaps> taps_ = std::make_shared<PeekTaps>();
};

// A binding that releases the port when it ends. Keeps a shared port alive.
class BoundSerialPort {
 public:
  BoundSerialPort(std::shared_ptr<SerialPort> port, ByteHandler& handler) : port_(std::move(port)) {
    port_->bind(handler);
  }
  BoundSerialPort(SerialPort& port, ByteHandler& handler)
      : BoundSerialPort({std::shared_ptr<void>(), &port}, handler) {}
  BoundSerialPort(BoundSerialPort&&) noexcept = default;
  BoundSerialPort& operator=(BoundSerialPort&&) = delete;
  ~BoundSerialPort() {
    if (port_) port_->release();
  }
  SerialPort* operator->() const noexcept { return port_.get(); }
  SerialPort& operator*() const noexcept { return *port_; }

 private:
  std::shared_ptr<SerialPort> port_;
};

}  // namespace mpf
