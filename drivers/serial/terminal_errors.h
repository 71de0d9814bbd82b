// SPDX-License-Identifier: MIT
// TerminalErrors: interprets the error counters of a terminal's driver (TIOCGICOUNT) for the bytes
// that were just read.
//
// The driver marks damaged bytes in the stream (MarkDecoder), but not the place where bytes were
// lost. It increments the overrun counter in its interrupt, and the bytes reach read() some
// milliseconds later. So each byte that is read within kMayBeLate after the counter has changed may
// follow the gap.
//
// Threads  one at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include <mpf/clock.h>
#include <mpf/drivers/serial/peek_taps.h>

namespace mpf {

class TerminalErrors {
 public:
  // Counters of the driver since the device was plugged in.
  struct Counts {
    std::uint64_t framing = 0;
    std::uint64_t overruns = 0;
  };
  // The longest time from the driver's interrupt to read() on a busy host.
  static constexpr std::chrono::milliseconds kMayBeLate{20};

  // Starts with the counters of a device that was opened. nullopt: the driver has no counters, as
  // for pseudo-terminals and some USB adapters.
  void begin(std::optional<Counts> counts) {
    seen_ = counts.value_or(Counts{});
    suspectUntil_ = Deadline::atNs(0);
  }

  // Call it after each read, with the present counters. Returns the fault of the bytes that the
  // driver has marked as damaged.
  LineFault take(const std::optional<Counts>& counts, bool hasParity) {
    if (!counts) return hasParity ? LineFault::parity : LineFault::framing;
    const auto before = std::exchange(seen_, *counts);
    if (counts->overruns != before.overruns) suspectUntil_ = Deadline::after(kMayBeLate);
    overruns_ += counts->overruns - before.overruns;
    return hasParity && counts->framing == before.framing ? LineFault::parity : LineFault::framing;
  }
  // Returns whether bytes may be missing before or between the bytes of the last read.
  [[nodiscard]] bool mayFollowGap() const { return !suspectUntil_.hasPassed(); }
  // Returns the number of bytes lost since the last call.
  [[nodiscard]] std::uint64_t takeOverruns() noexcept { return std::exchange(overruns_, 0); }

 private:
  Counts seen_;
  Deadline suspectUntil_ = Deadline::atNs(0);
  std::uint64_t overruns_ = 0;
};

}  // namespace mpf
