// SPDX-License-Identifier: MIT
// MarkDecoder: removes the marks from the bytes of a terminal. In the mode PARMRK the kernel puts a
// mark before each byte that the line damaged (termios(3)).
//
//   from the terminal   meaning
//   x                   x
//   ff ff               the byte ff
//   ff 00 x             the byte x, damaged
//   ff 00 00            a break
//
// Threads  one at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/serial/serial_line.h"

namespace mpf {

class MarkDecoder {
 public:
  // Decodes `raw` and appends the bytes. A mark may be split between two calls.
  //   damage  the fault of damaged bytes: the kernel does not distinguish parity and framing errors
  void decode(std::span<const std::uint8_t> raw, LineFault damage, std::vector<LineByte>& bytes) {
    for (const auto value : raw) decode(value, damage, bytes);
  }

 private:
  enum class State : std::uint8_t { plain, marked, damaged };

  void decode(std::uint8_t value, LineFault damage, std::vector<LineByte>& bytes) {
    switch (state_) {
      case State::plain:
        if (value == kMark) {
          state_ = State::marked;
        } else {
          bytes.push_back({value, LineFault::none});
        }
        return;
      case State::marked:
        state_ = value == 0 ? State::damaged : State::plain;
        if (value != 0) bytes.push_back({value, LineFault::none});
        return;
      case State::damaged:
        state_ = State::plain;
        bytes.push_back({value, value == 0 ? LineFault::breakSignal : damage});
        return;
    }
  }

  static constexpr std::uint8_t kMark = 0xff;
  State state_ = State::plain;
};

}  // namespace mpf
