// SPDX-License-Identifier: MIT
// SerialPort: a serial line of any kind (manual, "SerialPort").
//
//   const auto port = openPosixTerminal({.device = "/dev/ttyS0", .settings = {.baud = 9600}});
//   BoundSerialPort line(*port, handler);    // the ByteHandler receives each byte from now on
//   if (line->writeRead(command, 500ms) == SerialPortStatus::success) use(handler.answer());
//
//   binder's thread     write, read, writeRead ──┐                        ┌──► taps
//                                                ├──► the port's thread ──┤
//   the line            bytes, faults, unplug ───┘                        └──► byte handler
//
// A program binds a ByteHandler to a port and then makes requests: write, read, write-read or
// break. The byte handler receives each byte from the line and decides which byte ends a read. Taps
// (peek_taps.h) see the bytes of both directions.
//
//           device opened, connected
//   unplugged ──────────────────────► plugged      each request, and config(), fails at once while
//             ◄──────────────────────              the port is unplugged; the port reopens the line
//           device or connection lost              automatically
//
// Threads  any number of callers at a time, but one request at a time: a second request fails at
//          once. release(), config(), taps, counters() and state() may be called during a request.
//          Handlers run on the port's thread, one at a time; they must not block, throw or call the
//          port.
// Crash    nothing here survives the process; the kernel releases the line.
// Trust    the far end may send anything at any time, or disappear: requests fail or time out, and
//          none waits beyond its deadline.
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

// How a request ended.
enum class SerialPortStatus : std::uint8_t {
  success,
  timeout,
  failure,  // a line fault, an unplug, a release, or an error that the byte handler returned
};
enum class SerialPortState : std::uint8_t { unplugged, plugged };
// What a byte means for the outstanding read. Without an outstanding read, it has no effect.
enum class ByteHandlerResult : std::uint8_t {
  ok,  // the read continues
  endRead,  // the read ends with success
  error,  // the request ends with failure
};

[[nodiscard]] const char* toString(SerialPortStatus status) noexcept;
[[nodiscard]] const char* toString(SerialPortState state) noexcept;

// Receives the bytes of a port. All functions run on the port's thread, one at a time.
//
//   request   readBegins ─► sendBegins ─► byteReceived ... ─► readEnds
//
// byteReceived() may be called before, during and after a request. A handler that sets the answer
// aside in readEnds() needs no lock for it: the binder reads the answer after the request has
// returned, and the next answer is not set aside before the next request.
class ByteHandler {
 public:
  virtual ~ByteHandler() = default;
  // Called for each byte received, also when no read is outstanding. Bytes that the line damaged
  // are not passed: lineFailed() reports damaged and lost bytes.
  [[nodiscard]] virtual ByteHandlerResult byteReceived(std::uint8_t byte) = 0;
  // A read begins. All bytes that arrived before have been passed, and nothing of the request has
  // been sent.
  //   returns  ok to read; endRead when bytes that arrived before already satisfy the read; error
  //            to fail the request, and then nothing is sent
  [[nodiscard]] virtual ByteHandlerResult readBegins() { return ByteHandlerResult::ok; }
  // The kernel or the chip has accepted the first byte of a writeRead(). Bytes that are passed from
  // here on arrived after that.
  virtual void sendBegins() {}
  // Bytes may be missing between those passed before this call and those passed after it. Called
  // also when no read is outstanding. An outstanding read ends with failure right after this call.
  //   fault  the kind of fault; never `none`
  //   count  the number that counters() has added for this fault: bytes, breaks or unplugs; 0 for a
  //          further place where bytes may be missing that were counted before
  virtual void lineFailed(LineFault /*fault*/, std::uint64_t /*count*/) {}
  // The read has ended. Bytes that are passed from here on belong to no read.
  virtual void readEnds(SerialPortStatus /*status*/) {}
};

// Called after each change of the state.
//   because  why the line is unplugged; empty when it is plugged
// Runs on the port's thread; must not block, throw or call the port.
using StateHandler = std::function<void(SerialPortState state, const std::string& because)>;

// Numbers since the port was created.
struct SerialPortCounters {
  std::uint64_t bytesIn = 0;
  std::uint64_t bytesOut = 0;  // accepted by the kernel or the chip
  std::uint64_t timeouts = 0;  // requests
  std::uint64_t failures = 0;  // requests
  // bytes lost by the hardware or the kernel, where the driver counts them
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

  // Binds `handler`, which receives each byte from now on. A port has one binder at a time.
  //   handler  must outlive the binding, which ends with release()
  //   throws   std::runtime_error when the port is bound already
  virtual void bind(ByteHandler& handler) = 0;
  // Ends the binding, and an outstanding request with failure. The handler is not called after
  // return.
  virtual void release() = 0;

  // write() sends `data`; read() receives until the byte handler ends the read; writeRead() does
  // both, and receiving is enabled before the first byte is sent.
  //
  // A write has succeeded when all bytes have left the queue of the kernel or the chip, as far as
  // the line can report it. A write-read ends with its answer, even if bytes are still unsent in
  // that queue. Bytes that are not sent in time are discarded.
  //
  //   timeout   for the whole request, any number. 0 or less: the request ends at once, a read with
  //             the bytes that have arrived; a write then succeeds when the kernel or the chip
  //             accepts all bytes. More than 292 years: no timeout
  //   returns   failure at once while the line is unplugged, no handler is bound or another request
  //             is outstanding
  SerialPortStatus write(Bytes data, Milliseconds timeout) {
    return write(data, deadlineAfter(timeout));
  }
  SerialPortStatus read(Milliseconds timeout) { return read(deadlineAfter(timeout)); }
  SerialPortStatus writeRead(Bytes data, Milliseconds timeout) {
    return writeRead(data, deadlineAfter(timeout));
  }
  // The same with a deadline, which may have been set earlier (manual, "clientStartIoTimeout").
  SerialPortStatus write(Bytes data, Deadline deadline) { return transfer(data, false, deadline); }
  SerialPortStatus read(Deadline deadline) { return transfer({}, true, deadline); }
  SerialPortStatus writeRead(Bytes data, Deadline deadline) {
    return transfer(data, true, deadline);
  }
  // Sets a condition that ends requests early. The thread that waits for a request calls
  // `isAbandoned` every 20 ms; when it returns true, the request ends with failure. An empty
  // function removes the condition. To be called by the binder, between requests.
  virtual void abandonWhen(std::function<bool()> isAbandoned) = 0;
  // Holds the line in the break state for `duration`.
  //   returns  failure as for a write, and when this kind of line cannot send a break
  virtual SerialPortStatus sendBreak(Milliseconds duration) = 0;
  // How the last request ended.
  [[nodiscard]] virtual SerialPortStatus getStatus() const noexcept = 0;

  // Changes the settings of the line, all or none. A field that is 0 keeps its setting. The port
  // applies the settings again whenever it reopens the line.
  //   returns  empty; or a sentence that names the value that this line does not accept, or says
  //            that the line is unplugged
  [[nodiscard]] virtual std::string config(const SerialSettings& settings) = 0;

  // Attaches a listener: `handler` sees every byte that is sent or received until the PeekTap is
  // destroyed.
  [[nodiscard]] PeekTap attachTap(PeekHandler handler) { return taps_->attach(std::move(handler)); }

  [[nodiscard]] virtual SerialPortCounters counters() const noexcept = 0;
  [[nodiscard]] virtual SerialPortState state() const = 0;
  // Why the line is unplugged, for messages to people: the call, the object and the reason. Empty
  // when it is plugged.
  [[nodiscard]] virtual std::string unpluggedBecause() const = 0;
  // Waits for a state. Returns whether the port had that state before the deadline.
  [[nodiscard]] virtual bool waitForState(SerialPortState state, Deadline deadline) const = 0;
  // Replaces the function that is called after each change of the state. The previous function does
  // not run after return. An empty function removes it.
  virtual void onStateChange(StateHandler handler) = 0;
  // The device or the address, for messages to people.
  [[nodiscard]] virtual std::string description() const = 0;

 protected:
  virtual SerialPortStatus transfer(Bytes data, bool wantsRead, Deadline deadline) = 0;
  [[nodiscard]] const PeekTaps& taps() const noexcept { return *taps_; }
  // Accepts any number of milliseconds, because messages may contain any. Deadline::after() is
  // limited to what fits into nanoseconds.
  [[nodiscard]] static Deadline deadlineAfter(Milliseconds timeout) noexcept;

 private:
  std::shared_ptr<PeekTaps> taps_ = std::make_shared<PeekTaps>();
};

// A binding as an object: binds the port, and releases it when it is destroyed. Move-only.
class BoundSerialPort {
 public:
  // Shares the ownership of the port.
  //   throws  std::runtime_error when the port is bound already
  BoundSerialPort(std::shared_ptr<SerialPort> port, ByteHandler& handler) : port_(std::move(port)) {
    port_->bind(handler);
  }
  // `port` must outlive this object.
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
