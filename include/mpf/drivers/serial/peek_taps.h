// SPDX-License-Identifier: MIT
// PeekTaps: the listeners ("taps") of the bytes of a serial port. (`mpf tap`, which shows messages,
// is something else.) Each tap sees every byte that the port sends or receives, and does not
// disturb the requests (manual, "setSniffHandler"; a port can have any number of taps).
//
//   const auto tap = port->attachTap([](std::span<const PeekedByte> bytes) { print(bytes); });
//   ...                                  // the handler runs until `tap` is destroyed
//
// Threads  attach and detach by any thread, but not from a handler; handlers run on the port's
//          thread, one at a time.
// Crash    nothing here survives the process.
// Trust    a handler is code of this process: a handler that blocks delays the port, and a handler
//          that attaches or detaches a tap of the same port deadlocks.
// Source   manual, "setSniffHandler", "freeSniffHandler" and "serialPortSniff".
//          <mpf/serial_sniff.h> is the same for clients in other processes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace mpf {

// From the point of view of the port: `sent` to the instrument, `received` from it.
enum class ByteDirection : std::uint8_t { sent, received };

// A fault of a serial line. The first three faults damage a byte; the last two concern the line.
// The kernel does not distinguish parity and framing errors; where the driver of a terminal has no
// error counters either, damage counts as `parity` on a line with parity, else as `framing`.
enum class LineFault : std::uint8_t {
  none,
  parity,  // the parity bit is wrong: the value may be wrong, too
  framing,  // the stop bit is missing: the value may be wrong, too
  breakSignal,  // the line was held at 0 for longer than a character
  overrun,  // received bytes were lost before the port read them
  unplugged,  // the line was absent for some time
};

// One byte as the port saw it; written by the port.
struct PeekedByte {
  // CLOCK_MONOTONIC [ns]: when the port had passed the byte to the kernel or the chip, or had read
  // it from there. All bytes of one call have the same time, so it says nothing about the distance
  // of bytes on the line.
  std::int64_t atNs = 0;
  std::uint8_t value = 0;
  ByteDirection direction = ByteDirection::sent;
  // none, parity, framing or breakSignal; always none for a byte that was sent. Taps do not see
  // overruns and unplugs: SerialPort::counters() counts them.
  LineFault fault = LineFault::none;
};

// Receives the bytes in the order in which the port saw them, as many as the port handled at once:
// at least one, all of one direction. The span is valid during the call only. The handler must not
// block, and must not throw, which would end the process (std::terminate). A byte that was received
// reaches the taps before the port's ByteHandler.
using PeekHandler = std::function<void(std::span<const PeekedByte>)>;

class PeekTaps;

// An attached listener. Move-only; may outlive the port. The handler is destroyed when the tap is
// detached; objects that it refers to must exist until then.
class PeekTap {
 public:
  // A tap that is not attached.
  PeekTap() noexcept = default;
  PeekTap(PeekTap&&) noexcept = default;
  // Detaches the former listener first.
  PeekTap& operator=(PeekTap&& other) noexcept;
  // Detaches, as detach() does.
  ~PeekTap();
  // Ends the listening: the handler does not run after return. Waits for handlers of this port that
  // are running. Does nothing to a tap that is not attached.
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
  // Attaches `handler`, which must not be empty; it sees bytes from now on, until the PeekTap is
  // destroyed. Taps see bytes in the order in which they were attached.
  //   throws  std::bad_alloc
  [[nodiscard]] PeekTap attach(PeekHandler handler);
  // Used by PeekTap. Ignores an unknown id.
  void detach(std::uint64_t id) noexcept;
  // Whether no tap is attached: then the port spends no time on times and copies of bytes.
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
