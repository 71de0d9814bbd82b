// SPDX-License-Identifier: MIT
// TerminalErrors: what the error counters of a terminal's driver (TIOCGICOUNT) say about the bytes
// that were just read.
//
//   driver    counts an overrun, passes the bytes on         bytes reach read() some milliseconds
//             later
//   read()    bytes, counters                                the gap is among these bytes, or among
//   the next ones
//
// The driver marks damaged bytes in the stream (MarkDecoder), but not the place where bytes were
// lost: every byte that is read within kMayBeLate after the counter has grown may follow the gap.
//
// Threads  one.
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
  struct Counts {  // the driver's, since the device was plugged in
    std::uint64_t framing = 0;
    std::uint64_t overruns = 0;
  };
  // The way of bytes from the driver's interrupt to read(), on a host that is busy.
  static constexpr std::chrono::milliseconds kMayBeLate{20};

  // The device was opened. Without counts nothing is known of it: pseudo-terminals and some USB
  // adapters have none.
  void begin(std::optional<Counts> counts) {
    seen_ = counts.value_or(Counts{});
    suspectUntil_ = Deadline::atNs(0);
  }

  // Bytes were read, and the driver has counted so much by now. Returns what happened to those of
  // them that it marked as damaged.
  LineFault take(const std::optional<Counts>& counts, bool hasParity) {
    if (!counts) return hasParity ? LineFault::parity : LineFault::framing;
    const auto before = std::exchange(seen_, *counts);
    if (counts->overruns != before.overruns) suspectUntil_ = Deadline::after(kMayBeLate);
    overruns_ += counts->overruns - before.overruns;
    return hasParity && counts->framing == before.framing ? LineFault::parity : LineFault::framing;
  }
  // Bytes may be missing before or between the bytes that take() was told of.
  [[nodiscard]] bool mayFollowGap() const { return !suspectUntil_.hasPassed(); }
  [[nodiscard]] std::uint64_t takeOverruns() noexcept { return std::exchange(overruns_, 0); }

 private:
  Counts seen_;
  Deadline suspectUntil_ = Deadline::atNs(0);
  std::uint64_t overruns_ = 0;
};

}  // namespace mpf
