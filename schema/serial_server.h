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
inline constexpr std::int32_t serialServerStatusOverflow = 2;
inline constexpr std::int32_t serialServerStatusError = 3;

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::serial
