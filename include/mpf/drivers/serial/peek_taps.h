// SPDX-License-Identifier: MIT
// PeekTaps: the listeners of a port, each of which sees every byte that crosses the line (manual,
// "setSniffHandler"; here any number).
//
// Threads  attach and detach from any thread; handlers run on the port's thread.
// Crash    nothing here survives the process.
// Trust    a handler that blocks holds the port up; one that attaches or detaches a tap of the same
//          port locks up.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace mpf {

enum class ByteDirection : std::uint8_t { sent, received };

// What the line did to a received byte. Parity and framing may be told apart only where the driver
// counts them. The last two are faults of the line and of no byte: overrun, bytes came and were
// lost before anybody read them; unplugged, the line was away for some time.
enum class LineFault : std::uint8_t { none, parity, framing, breakSignal, overrun, unplugged };

struct PeekedByte {
  // CLOCK_MONOTONIC, when the port had handed it to the kernel or got it from there
  std::int64_t atNs = 0;
  std::uint8_t value = 0;
  ByteDirection direction = ByteDirection::sent;
  LineFault fault = LineFault::none;
};

// Gets the bytes in the order in which the port saw them, as many as came at once. Must not block,
// must not throw.
using PeekHandler = std::function<void(std::span<const PeekedByte>)>;

class PeekTaps;

// A listener's place. Destroying it detaches: afterwards the handler does not run any more. May
// outlive the port.
class PeekTap {
 public:
  PeekTap() noexcept = default;
  PeekTap(PeekTap&&) noexcept = default;
  PeekTap& operator=(PeekTap&& other) noexcept;
  ~PeekTap();
  void detach() noexcept;

 private:
  friend class PeekTaps;
  PeekTap(std::shared_ptr<PeekTaps> taps, std::uint64_t id) noexcept
      : taps_(std::move(taps)), id_(id) {}
  std::shared_ptr<PeekTaps> taps_;
  std::uint64_t id_ = 0;
};

class PeekTaps : public std::enable_shared_from_this<PeekTaps> {
 public:
  [[nodiscard]] PeekTap attach(PeekHandler handler);
  void detach(std::uint64_t id) noexcept;
  [[nodiscard]] bool isEmpty() const noexcept;
  void show(std::span<const PeekedByte> bytes) const noexcept;

 private:
  struct Entry {
    std::uint64_t id = 0;
    PeekHandler handler;
  };
  mutable std::mutex mutex_;  // held while handlers run, so that detach() can promise
  std::vector<Entry> entries_;
  std::uint64_t lastId_ = 0;
};

}  // namespace mpf
