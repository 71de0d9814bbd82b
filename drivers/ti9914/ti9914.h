// SPDX-License-Identifier: MIT
// The registers of a TI9914 GPIB controller in the I/O space of a GreenSpring IP-488: bytes at odd
// addresses.
//
// Source   TMS9914A data manual; drvGsIP488 of asyn for the addresses and the vector; tms9914.h of
//          Linux GPIB.
#pragma once

#include <cstddef>
#include <cstdint>

#include <mpf/drivers/industry_pack/module.h>

namespace mpf {

inline const ModuleKind kIp488{"GreenSpring IP-488", kGreenSpring, {0x14}};

namespace ti9914 {

// Two names with one offset: the first is read, the second is written.
enum Register : std::size_t {
  kIsr0 = 0x01,
  kImr0 = 0x01,
  kIsr1 = 0x03,
  kImr1 = 0x03,
  kAdsr = 0x05,
  kBsr = 0x07,  // the bits are those of gpib_line
  kAuxcr = 0x07,
  kAdr = 0x09,
  kSpmr = 0x0b,
  kCptr = 0x0d,
  kPpr = 0x0d,
  kDir = 0x0f,
  kCdor = 0x0f,
  kVector = 0x13,
};
// The module requests interrupts only with an odd vector.
inline constexpr std::uint8_t kVectorEnabled = 0x01;

// A read clears the events of the register.
enum Isr0 : std::uint8_t {
  kEnd = 0x08,  // the byte in DIR came with EOI
  kBo = 0x10,  // CDOR can take a byte
  kBi = 0x20,  // DIR has a byte
  kInt1 = 0x40,  // an enabled event of ISR1
  kInt0 = 0x80,  // an enabled event of ISR0
};
enum Isr1 : std::uint8_t {
  kSrq = 0x02,  // the SRQ line became active
  kErr = 0x40,  // a byte was to be sent, and no device on the bus accepts bytes
};
enum Adsr : std::uint8_t { kTalkerAddressed = 0x02, kListenerAddressed = 0x04, kAttention = 0x20 };

// Commands to AUXCR. kSet is added to those that set a state; without it they end the state.
inline constexpr std::uint8_t kSet = 0x80;
enum Aux : std::uint8_t {
  kSwrst = 0x00,  // state: all functions are idle
  kRhdf = 0x02,  // ends the holdoff: the next byte may come
  kHdfa = 0x03,  // state: holdoff after each received byte
  kHdfe = 0x04,  // state: holdoff after a byte with END
  kNbaf = 0x05,  // discards the byte in CDOR that is not on the bus yet
  kFeoi = 0x08,  // the next byte is sent with EOI
  kLon = 0x09,  // state: listener
  kTon = 0x0a,  // state: talker
  kGts = 0x0b,  // releases ATN
  kTca = 0x0c,  // drives ATN, at once
  kTcs = 0x0d,  // drives ATN, when no byte is on the bus
  kSic = 0x0f,  // state: drives IFC; takes charge of the bus
  kSre = 0x10,  // state: drives REN
  kDai = 0x13,  // state: no interrupts
};
// The chip loses commands that follow each other faster.
inline constexpr std::int64_t kAuxSpacingNs = 6'000;

}  // namespace ti9914
}  // namespace mpf
