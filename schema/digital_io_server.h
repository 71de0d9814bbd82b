// SPDX-License-Identifier: MIT
// What clients of a digital I/O server say and hear. All messages are Int32; each request gets a reply with status 0, or -1: nothing was
// done. Bits are those of the module: of 24 lines bits 0 to 23.
//
//   server <module>Out                                        server <module>In
//     cmdSetBits    address=mask                                cmdStartMonitor  address=mask, 0: all
//     cmdClearBits  address=mask                                cmdStopMonitor
//     cmdWriteBits  address=mask value=bits                     cmdSetEdges      address=rising value=falling
//     cmdSetDAC     value=0 to 4095, in 15 mV
//     cmdReadBits   address=mask ──► value, of outputs          the same, of inputs
//     cmdReadBits16 address=mask extra=lowest bit ──► value     the same, of inputs
//
// A monitor
//
//   client                             server <module>In
//     cmd=cmdStartMonitor ──►
//                         ◄── status=0 value=inputs address=mask           at once
//                         ◄── status=0 value=inputs address=what changed   whenever one of the mask's bits changes or had an edge
//                         ◄── status=-1 value=inputs as they were          the module is gone; the next one with status 0: it is back,
//                                                                          with what was written to its outputs, and with its threshold
//     cmd=cmdStopMonitor  ──►
//                         ◄── status=0                                     nothing comes after it
//
// are more replies to the same request. A client has one monitor: another cmdStartMonitor replaces it. There may be any number of clients.
// One that does not take its messages, so that a reply cannot be delivered, loses its monitor, and nobody else anything.
//
// cmdSetBits to cmdSetDAC, and what they mean, are the original's numbers; the others are ours.
#pragma once

#include <cstdint>

namespace mpf::digital {

// NOLINTBEGIN(readability-identifier-naming): the original's words

inline constexpr std::int32_t cmdSetBits = 1;
inline constexpr std::int32_t cmdClearBits = 2;
inline constexpr std::int32_t cmdStartMonitor = 3;
inline constexpr std::int32_t cmdStopMonitor = 4;
inline constexpr std::int32_t cmdSetDAC = 5;

inline constexpr std::int32_t cmdWriteBits = 6;    // those of the mask, both ways at once
inline constexpr std::int32_t cmdReadBits = 7;     // bits & mask
inline constexpr std::int32_t cmdReadBits16 = 8;   // (bits >> extra) & mask & 0xffff, extra 0 to 16: for 16-bit records
inline constexpr std::int32_t cmdSetEdges = 9;     // which edges interrupt from now on, for all clients

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::digital
