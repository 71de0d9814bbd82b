// SPDX-License-Identifier: MIT
// The messages between a serial server and the listeners of its line. Any number of clients may
// listen, in any process.
//
//   listener                      server "<serial server>.sniff"
//     Int32 cmd=cmdSniffStart ──►
//                             ◄── Int32 status=sniffStatusOK
//                             ◄── Char8Array extra=3 address=0 value=| T 31 | T 0d | R 31 |
//                             ◄── Char8Array extra=2 address=7 value=| R 32 | R 0d |
//     Int32 cmd=cmdSniffStop  ──►
//                             ◄── Int32 status=sniffStatusOK address=0    the last message
//
// The Char8Array messages are further replies to the request cmdSniffStart, with its clientType and
// clientExtra. Each has
//   value    `extra` records in the order of the line, see SniffRecord
//   extra    number of records, 1 or more
//   address  number of bytes that are missing before this message, because the listener did not
//            receive its messages in time or the server was too slow; at most 2^31 - 1, and the
//            next message counts the rest
// The server collects records for at most about 20 ms: a slow line gives small messages and a fast
// line large ones.
//
// The replies to start and stop are Int32 with
//   status   sniffStatusOK; sniffStatusNotListening: stop without start; sniffStatusError: unknown
//            cmd
//   address  for stop: number of bytes before the stop that are missing at the end
//
// If a client starts again while it listens, later records are replies to the new request; no
// record is sent twice. A client may disconnect or exit without a stop. A client that does not
// receive its messages loses bytes; neither the line nor other listeners wait for it. When the
// server exits, the listener gets a ConnectMessage.
//
// Source   manual, "Diagnostic Aids": serialPortSniff. The messages are those of this project.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <mpf/message_of.h>

namespace mpf::serial {

// NOLINTBEGIN(readability-identifier-naming): same style as the names of serial_commands.h

// Added to the name of the serial server, it is the name of the server for listeners.
inline constexpr std::string_view sniffSuffix = ".sniff";

// `cmd` of a request, an Int32 message.
inline constexpr std::int32_t cmdSniffStart = 1;
inline constexpr std::int32_t cmdSniffStop = 2;

// `status` of the Int32 reply.
inline constexpr std::int32_t sniffStatusOK = 0;
inline constexpr std::int32_t sniffStatusNotListening = 1;
inline constexpr std::int32_t sniffStatusError = 3;

// NOLINTEND(readability-identifier-naming)

// What happened on the line; the value is the byte in the record.
enum class SniffKind : char {
  sent = 'T',  // a byte was transmitted
  received = 'R',
  damaged = 'r',  // received with a parity or framing error; the value is the byte that arrived
  breakSignal = 'B',  // a break was received; the value is 0
};

// One byte of the line.
//
//   | at: 8 bytes, little-endian | kind | value |     10 bytes, no padding
struct SniffRecord {
  static constexpr std::size_t kBytes = 10;

  // [ns] CLOCK_MONOTONIC of the server's host when the kernel accepted or delivered the byte.
  std::int64_t atNs = 0;
  SniffKind kind = SniffKind::sent;
  std::uint8_t value = 0;  // the byte

  // The record as it is in a message.
  void write(std::span<char, kBytes> bytes) const noexcept;
  // Returns nullopt when the kind is unknown.
  [[nodiscard]] static std::optional<SniffRecord> tryRead(
      std::span<const char, kBytes> bytes) noexcept;

  friend bool operator==(const SniffRecord&, const SniffRecord&) = default;
};

// Returns the records of a Char8Array message; nullopt when it is invalid: its size does not match
// `extra`, or a kind is unknown. Throws std::bad_alloc.
[[nodiscard]] std::optional<std::vector<SniffRecord>> tryReadRecords(
    const Char8ArrayMessage& reply);

}  // namespace mpf::serial
