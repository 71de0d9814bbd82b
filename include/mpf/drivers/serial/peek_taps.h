// SPDX-License-Identifier: MIT
// PeekTaps: the listeners ("taps") of a serial port. Each tap sees every byte that the port sends
// or receives, and does not disturb the requests (manual, "setSniffHandler"; a port can have any
// number of taps).
//
//   const auto tap = port->attachTap([](std::span<const PeekedByte> bytes) { print(bytes); });
//   ...                                  // the handler runs until `tap` is destroyed
//
// Threads  attach and detach by any thread, but not from a handler; handlers run on the port's
//          thread, one at a time.
// Crash    nothing here survives the process.
// Trust    a handler is code of this process: a handler that blocks delays the port, and a handler
//          that attaches or detaches a tap of the same port deadlocks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace mpf {

enum class ByteDirection : std::uint8_t { sent, received };

// A fault of a serial line. The first three faults damage a byte; the last two concern the line.
// The kernel does not distinguish parity and framing errors; where the driver of a terminal has no
// error counters either, damage counts as `parity` on a line with parity, else as `framing`.
enum class LineFault : std::uint8_t {
  none,
  parity,
  framing,
  breakSignal,
  overrun,  // received bytes were lost before the port read them
  unplugged,  // the line was absent for some time
};

struct PeekedByte {
  // CLOCK_MONOTONIC [ns]: when the port had passed the byte to the kernel or the chip, or had read
  // it from there.
  std::int64_t atNs = 0;
  std::uint8_t value = 0;
  ByteDirection direction = ByteDirection::sent;
  LineFault fault = LineFault::none;  // none, parity, framing or breakSignal
};

// Receives the bytes in the order in which the port saw them, as many as the port handled at once.
// Must not block and must not throw.
using PeekHandler = std::function<void(std::span<const PeekedByte>)>;

class PeekTaps;

// An attached listener. Move-only; may outlive the port.
class PeekTap {
 public:
  // A tap that is not attached.
  PeekTap() noexcept = default;
  PeekTap(PeekTap&&) noexcept = default;
  PeekTap& operator=(PeekTap&& other) noexcept;
  // Detaches.
  ~PeekTap();
  // Ends the listening: the handler does not run after return. Waits for a handler that is running.
  void detach() noexcept;

 private:
  friend class PeekTaps;
  PeekTap(std::shared_ptr<PeekTaps> taps, std::uint64_t id) noexcept
      : taps_(std::move(taps)), id_(id) {}
  std::shared_ptr<PeekTaps> taps_;
  std::uint64_t id_ = 0;
};

// The taps of one port. Programs use SerialPort::attachTap().
class PeekTaps : public std::enable_shared_from_this<PeekTaps> {
 public:
  [[nodiscard]] PeekTap attach(PeekHandler handler);
  // Used by PeekTap.
  void detach(std::uint64_t id) noexcept;
  [[nodiscard]] bool isEmpty() const noexcept;
  // Calls each handler with `bytes`. Used by the port.
  void show(std::span<const PeekedByte> bytes) const noexcept;

 private:
  struct Entry {
    std::uint64_t id = 0;
    PeekHandler handler;
  };
  mutable std::mutex mutex_;  // locked while handlers run, so that detach() waits for them
  std::vector<Entry> entries_;
  std::uint64_t lastId_ = 0;
};

}  // namespace mpf
