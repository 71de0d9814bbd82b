// SPDX-License-Identifier: MIT
// GpibLines: the sixteen lines of a GPIB bus. A control line is active when at least one of the
// connected devices drives it (wired-or), and so is a data line.
//
// Threads  plain values.
// Source   IEEE 488.1; the bits are those of the bus status register of a TI9914.
#pragma once

#include <cstdint>
#include <string>

namespace mpf {

namespace gpib_line {
enum Line : std::uint8_t {
  kRen = 0x01,  // remote enable
  kIfc = 0x02,  // interface clear
  kSrq = 0x04,  // an instrument requests service
  kEoi = 0x08,  // end of a message
  kNrfd = 0x10,  // not ready for data
  kNdac = 0x20,  // data not accepted
  kDav = 0x40,  // data valid
  kAtn = 0x80,  // the byte is a command
};
}  // namespace gpib_line

struct GpibLines {
  std::uint8_t control = 0;  // of gpib_line
  std::uint8_t data = 0;

  [[nodiscard]] constexpr bool has(gpib_line::Line line) const noexcept {
    return (control & line) != 0;
  }
  constexpr GpibLines& operator|=(const GpibLines& other) noexcept {
    control |= other.control;
    data |= other.data;
    return *this;
  }
  bool operator==(const GpibLines&) const = default;
};

// The names of the active control lines, "ATN NDAC", or "none".
[[nodiscard]] std::string namesOfLines(std::uint8_t control);

}  // namespace mpf
