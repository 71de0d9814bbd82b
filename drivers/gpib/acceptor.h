// SPDX-License-Identifier: MIT
// GpibAcceptor: the acceptor handshake of a device on a GpibBusModel.
//
//   state     drives       next
//   idle      -            when it takes part and DAV is inactive: notReady
//   notReady  NRFD, NDAC   when it can take a byte: ready
//   ready     NDAC         when DAV is active: taking
//   taking    NRFD, NDAC   when it has taken the byte: taken
//   taken     NRFD         when DAV is inactive: notReady
//
// A device that takes part while DAV is active waits for the next byte, as notReady. A change of
// ATN starts again with idle, so that no data byte is taken for a command.
//
// Threads  as GpibParticipant.
// Source   IEEE 488.1, acceptor handshake (AH).
#pragma once

#include <cstdint>

#include "drivers/gpib/bus_lines.h"

namespace mpf {

class GpibAcceptor {
 public:
  // Returns the lines that it drives.
  //   takesPart  whether the device accepts bytes: all instruments while ATN is active, else the
  //              listeners
  //   canTake    called to learn whether it is ready for a byte
  //   take       called with a byte; returns whether it was accepted
  template <class CanTake, class Take>
  std::uint8_t follow(const GpibLines& seen, bool takesPart, CanTake canTake, Take take) {
    const bool attention = seen.has(gpib_line::kAtn);
    if (!takesPart || attention != attention_) state_ = State::idle;
    attention_ = attention;
    if (!takesPart) return 0;
    const bool isValid = seen.has(gpib_line::kDav);
    if ((state_ == State::idle || state_ == State::taken) && !isValid) state_ = State::notReady;
    if (state_ == State::notReady && !isValid && canTake()) state_ = State::ready;
    if (state_ == State::ready && isValid) state_ = State::taking;
    if (state_ == State::taking && !isValid) state_ = State::notReady;
    if (state_ == State::taking && take()) state_ = State::taken;
    return driven();
  }

 private:
  enum class State : std::uint8_t { idle, notReady, ready, taking, taken };

  [[nodiscard]] std::uint8_t driven() const noexcept {
    if (state_ == State::ready) return gpib_line::kNdac;
    if (state_ == State::taken) return gpib_line::kNrfd;
    return gpib_line::kNrfd | gpib_line::kNdac;
  }

  State state_ = State::idle;
  bool attention_ = false;
};

}  // namespace mpf
