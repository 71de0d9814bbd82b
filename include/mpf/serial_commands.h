// SPDX-License-Identifier: MIT
// The commands and statuses of serial servers. Client and server exchange Char8Array messages:
//
//   request   cmd = command | options, value = bytes to write
//             timeout [s], or [ms] with cmdTimeoutMilliseconds: longest time that the instrument
//             may take, without the wait for earlier requests; 0: a read returns the bytes that
//             were received before
//             extra > 0: read at most `extra` bytes
//             numberRetrys: how often a request that failed is repeated; a read is repeated only
//             after a timeout, and keeps the bytes of its earlier attempts
//             eomLen, eomString: the new end of message, with cmdSetEom
//   reply     status = serialServerStatus..., value = bytes that were read, extra = serialFault...
//
// When a server exits, it replies to the request in progress with serialServerStatusError. Requests
// that it has not taken end as `neverTaken`, and none of their bytes were sent. A request whose
// cmd has no command or an unknown option gets serialServerStatusError and has no effect.
// <mpf/serial_sniff.h> describes how to listen to the line.
//
// Source   manual, "serialServer". The numbers are those of this project: no public source gives
//          the original ones. cmdTimeoutMilliseconds and serialFault... are additions.
#pragma once

#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf::serial {

// NOLINTBEGIN(readability-identifier-naming): names of the manual

// `cmd` of a request: one command, OR-ed with any options.

// Reads until the end of message, `extra` bytes, a full buffer or the timeout.
inline constexpr std::int32_t cmdRead = 1;
// Writes `value`.
inline constexpr std::int32_t cmdWrite = 2;
// Writes `value`, then reads. The input is enabled before the first byte is sent.
inline constexpr std::int32_t cmdWriteRead = cmdRead | cmdWrite;
// The bits of the command; the others are options.
inline constexpr std::int32_t cmdCommandMask = 0xf;

// Options.

// First drops all bytes that were received before.
inline constexpr std::int32_t cmdFlush = 0x10;
// Starts and stops the storing of bytes that are received while no request reads, for all clients.
inline constexpr std::int32_t cmdStartCircularBuffer = 0x20;
inline constexpr std::int32_t cmdStopCircularBuffer = 0x40;
// Makes eomLen and eomString the end of message, for all clients; eomLen 0: no end of message.
inline constexpr std::int32_t cmdSetEom = 0x80;
// `timeout` is in milliseconds instead of seconds.
inline constexpr std::int32_t cmdTimeoutMilliseconds = 0x100;

// `status` of a reply. With any status, `value` has all bytes that were read, including the end of
// message.

inline constexpr std::int32_t serialServerStatusOK = 0;
inline constexpr std::int32_t serialServerStatusTimeout = 1;
// The answer is longer than the buffer, or the buffer of the UART overflowed.
inline constexpr std::int32_t serialServerStatusOverflow = 2;
inline constexpr std::int32_t serialServerStatusError = 3;

// `extra` of a reply with status Overflow or Error: a bit for each kind of fault that the line had
// during the answer or immediately before it; 0 when the status has another reason. With other
// statuses `extra` is that of the request. A fault that the line has while no request reads is
// reported with the answer whose bytes are damaged or missing. If the faults alone decide on the
// status, serialFaultOverrun makes it Overflow and any other fault makes it Error.

// Bytes are missing: the UART or its driver was not read in time.
inline constexpr std::int32_t serialFaultOverrun = 1;
// A byte had a parity error; the byte is not in the answer.
inline constexpr std::int32_t serialFaultParity = 2;
// A byte had no stop bit; the byte is not in the answer.
inline constexpr std::int32_t serialFaultFraming = 4;
// A break was received.
inline constexpr std::int32_t serialFaultBreak = 8;
// The line was lost: the adapter was unplugged, or its device file failed.
inline constexpr std::int32_t serialFaultUnplugged = 16;

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::serial
