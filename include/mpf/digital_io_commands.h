// SPDX-License-Identifier: MIT
// The messages between a digital I/O server and its clients. All messages are Int32. Each request
// gets a reply with status 0, or with -1 if nothing was done. Bits are numbered as in the module:
// bits 0 to 23 for 24 lines.
//
//   server <module>Out                                        server <module>In
//     cmdSetBits    address=mask                                cmdStartMonitor  address=mask, 0:
//                   all
//     cmdClearBits  address=mask                                cmdStopMonitor
//     cmdWriteBits  address=mask value=bits                     cmdSetEdges      address=rising
//                   value=falling
//     cmdSetDAC     value=0 to 4095, in 15 mV
//     cmdReadBits   address=mask ──► value of the outputs       the same for the inputs
//     cmdReadBits16 address=mask extra=lowest bit ──► value     the same for the inputs
//
// A monitor:
//
//   client                             server <module>In
//     cmd=cmdStartMonitor ──►
//                         ◄── status=0 value=inputs address=mask           at once
//                         ◄── status=0 value=inputs address=changed bits   when a bit of the mask changes or had an edge
//                         ◄── status=-1 value=last inputs                  the module is gone
//                         ◄── status=0 value=inputs                        the module is back; outputs and threshold are restored
//     cmd=cmdStopMonitor  ──►
//                         ◄── status=0                                     the last message
//
// The messages of a monitor are further replies to the same request. A client has one monitor:
// another cmdStartMonitor replaces it. Any number of clients may have monitors. A client that does
// not take its messages loses its monitor when a reply cannot be delivered; no other client is
// affected.
//
// Source  the numbers and meanings of cmdSetBits to cmdSetDAC are those of the original MPF; the
//         other commands are additions.
#pragma once

#include <cstdint>

namespace mpf::digital {

// NOLINTBEGIN(readability-identifier-naming): names of the original MPF

inline constexpr std::int32_t cmdSetBits = 1;
inline constexpr std::int32_t cmdClearBits = 2;
inline constexpr std::int32_t cmdStartMonitor = 3;
inline constexpr std::int32_t cmdStopMonitor = 4;
inline constexpr std::int32_t cmdSetDAC = 5;

inline constexpr std::int32_t cmdWriteBits = 6;  // sets and clears the bits of the mask at once
inline constexpr std::int32_t cmdReadBits = 7;  // bits & mask
// (bits >> extra) & mask & 0xffff, extra 0 to 16: for 16-bit records
inline constexpr std::int32_t cmdReadBits16 = 8;
// selects the edges that interrupt, for all clients
inline constexpr std::int32_t cmdSetEdges = 9;

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::digital
