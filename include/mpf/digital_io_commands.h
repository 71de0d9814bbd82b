// SPDX-License-Identifier: MIT
// The messages between a digital I/O server and its clients. All messages are Int32. Each request
// gets a reply with status 0, or with status -1 when the server did nothing. Bits are numbered as
// in the module: bits 0 to 23 for 24 lines.
//
//   server <module>Out                       server <module>In
//     cmdSetBits     address=mask              cmdStartMonitor  address=mask, 0: all bits
//     cmdClearBits   address=mask              cmdStopMonitor
//     cmdWriteBits   address=mask value=bits   cmdSetEdges      address=rising value=falling
//     cmdSetDAC      value=0 to 4095
//     cmdReadBits    address=mask              cmdReadBits      address=mask
//     cmdReadBits16  address=mask extra=bit    cmdReadBits16    address=mask extra=bit
//
// mpf-ip440-server has one server, with the name of the module: cmdReadBits and cmdReadBits16 only.
//
// A monitor:
//
//   client                      server <module>In
//     cmd=cmdStartMonitor ──►
//                         ◄── status=0   value=inputs address=mask       immediately
//                         ◄── status=0   value=inputs address=changed    a bit of the mask changed
//                                                                        or had an edge
//                         ◄── status=-1  value=last inputs               the module fails
//                         ◄── status=0   value=inputs                    the module works again
//     cmd=cmdStopMonitor  ──►
//                         ◄── status=0                                   the last message
//
// When the module works again, the server has restored its outputs and its threshold. The
// messages of a monitor are further replies to the request cmdStartMonitor. A client has at most
// one monitor: another cmdStartMonitor replaces it. Any number of clients may have monitors.
//
// When a client does not receive its messages and its queue is full, its further changes are merged
// into one message: all bits that changed since the last message, and the last inputs and status.
// The client gets it when it receives again; no other client is affected.
//
// Source  the numbers and meanings of cmdSetBits to cmdSetDAC are those of the original MPF; the
//         other commands are additions.
#pragma once

#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf::digital {

// NOLINTBEGIN(readability-identifier-naming): names of the original MPF

// Sets the output bits of the mask; the other bits keep their values.
inline constexpr std::int32_t cmdSetBits = 1;
// Clears the output bits of the mask.
inline constexpr std::int32_t cmdClearBits = 2;
// Starts or replaces the monitor of this client.
inline constexpr std::int32_t cmdStartMonitor = 3;
inline constexpr std::int32_t cmdStopMonitor = 4;
// Sets the threshold of the inputs, in steps of 15 mV.
inline constexpr std::int32_t cmdSetDAC = 5;

// Writes `bits` to the output bits of the mask in one step.
inline constexpr std::int32_t cmdWriteBits = 6;
// The value of the reply is the outputs or inputs & mask.
inline constexpr std::int32_t cmdReadBits = 7;
// For 16-bit records: the value is (bits >> extra) & mask & 0xffff, with extra from 0 to 16.
inline constexpr std::int32_t cmdReadBits16 = 8;
// Selects the edges that interrupt, for all clients: two masks, for rising and for falling edges.
inline constexpr std::int32_t cmdSetEdges = 9;

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::digital
