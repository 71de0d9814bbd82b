// SPDX-License-Identifier: MIT
// The commands and statuses of serial servers (manual, "serialServer"). The numbers are those of
// this project; no public source gives the original ones.
//
// When a server ends, the request that is on the line gets serialServerStatusError. Requests that
// it has not taken end as `neverTaken`, and nothing of them was sent. serial_sniff.h describes how
// to listen to the line.
#pragma once

#include <cstdint>

namespace mpf::serial {

// NOLINTBEGIN(readability-identifier-naming): names of the manual

// `cmd` of a Char8ArrayMessage: one command, OR-ed with any options.
inline constexpr std::int32_t cmdRead = 1;
inline constexpr std::int32_t cmdWrite = 2;
// input is enabled before the first byte is sent
inline constexpr std::int32_t cmdWriteRead = cmdRead | cmdWrite;
inline constexpr std::int32_t cmdCommandMask = 0xf;
// first drop all bytes that were received before
inline constexpr std::int32_t cmdFlush = 0x10;
// store bytes that are received outside of reads
inline constexpr std::int32_t cmdStartCircularBuffer = 0x20;
inline constexpr std::int32_t cmdStopCircularBuffer = 0x40;
// eomLen and eomString set the end of message, for all clients
inline constexpr std::int32_t cmdSetEom = 0x80;
// `timeout` is in milliseconds, not in seconds
inline constexpr std::int32_t cmdTimeoutMilliseconds = 0x100;

// `status` of the reply. With any status, the reply has all bytes that were read, end of message
// included.
inline constexpr std::int32_t serialServerStatusOK = 0;
inline constexpr std::int32_t serialServerStatusTimeout = 1;
// the answer is longer than the buffer, or the UART's buffer overflowed
inline constexpr std::int32_t serialServerStatusOverflow = 2;
inline constexpr std::int32_t serialServerStatusError = 3;

// `extra` of a reply with status Overflow or Error: a bit for each kind of fault that the line had
// within the answer or right before it. 0: none; the status has another reason. With any other
// status `extra` is that of the request. Faults that the line has while nobody reads count as well:
// the answer whose bytes are damaged or missing has their bits. Of these alone only
// serialFaultOverrun makes the status Overflow, the others make it Error.
// bytes are missing: the UART or its driver was not read in time
inline constexpr std::int32_t serialFaultOverrun = 1;
// a byte with a parity error, which is not in the answer
inline constexpr std::int32_t serialFaultParity = 2;
// a byte without a stop bit, which is not in the answer
inline constexpr std::int32_t serialFaultFraming = 4;
inline constexpr std::int32_t serialFaultBreak = 8;  // a break
inline constexpr std::int32_t serialFaultUnplugged = 16;  // the line was lost

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::serial
