// SPDX-License-Identifier: MIT
// What clients of a serial server say and hear (manual, "serialServer"). The numbers are ours: no public source tells the original's.
//
// A server that ends answers the request that is on the line with serialServerStatusError; those that it has not taken yet end as
// `neverTaken`, and nothing of them was sent. How to listen to the line: serial_sniff.h.
#pragma once

#include <cstdint>

namespace mpf::serial {

// NOLINTBEGIN(readability-identifier-naming): the manual's words

// `cmd` of a Char8ArrayMessage: one command and any options.
inline constexpr std::int32_t cmdRead = 1;
inline constexpr std::int32_t cmdWrite = 2;
inline constexpr std::int32_t cmdWriteRead = cmdRead | cmdWrite;  // input is enabled before the first byte is sent
inline constexpr std::int32_t cmdCommandMask = 0xf;
inline constexpr std::int32_t cmdFlush = 0x10;                // drop what was received before
inline constexpr std::int32_t cmdStartCircularBuffer = 0x20;  // keep what is received while nobody reads
inline constexpr std::int32_t cmdStopCircularBuffer = 0x40;
inline constexpr std::int32_t cmdSetEom = 0x80;               // eomLen and eomString are the end of message from now on, for all clients
inline constexpr std::int32_t cmdTimeoutMilliseconds = 0x100;  // `timeout` is in milliseconds, not in seconds

// `status` of the reply. Whatever was read is in it, the end of message included, whatever the status.
inline constexpr std::int32_t serialServerStatusOK = 0;
inline constexpr std::int32_t serialServerStatusTimeout = 1;
inline constexpr std::int32_t serialServerStatusOverflow = 2;  // the answer is longer than the buffer, or the UART's buffer overflowed
inline constexpr std::int32_t serialServerStatusError = 3;

// `extra` of a reply with status Overflow or Error: a bit for each kind of fault that the line had within the answer or right before
// it. 0: none; the status has another reason. With any other status `extra` is that of the request.
// Faults that the line has while nobody reads count as well: the answer whose bytes are damaged or missing has their bits.
// Of these alone only serialFaultOverrun makes the status Overflow, the others make it Error.
inline constexpr std::int32_t serialFaultOverrun = 1;   // bytes are missing: the UART or its driver was not read in time
inline constexpr std::int32_t serialFaultParity = 2;    // a byte with a parity error, which is not in the answer
inline constexpr std::int32_t serialFaultFraming = 4;   // a byte without a stop bit, which is not in the answer
inline constexpr std::int32_t serialFaultBreak = 8;     // a break
inline constexpr std::int32_t serialFaultUnplugged = 16;  // the line was lost

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::serial
