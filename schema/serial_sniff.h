// SPDX-License-Identifier: MIT
// What listeners of a serial line say and hear (manual, "serialPortSniff"; here any number of them, from any process).
//
//   listener                      server "<serial server>.sniff"
//     Int32 cmd=cmdSniffStart ──►
//                             ◄── Int32 status=sniffStatusOK
//                             ◄── Char8Array extra=3 address=0 value=| T 31 | T 0d | R 31 |      more replies to the same request,
//                             ◄── Char8Array extra=2 address=7 value=| R 32 | R 0d |             with its marks, until ...
//     Int32 cmd=cmdSniffStop  ──►
//                             ◄── Int32 status=sniffStatusOK address=0                           ... this one: nothing comes after it
//
// Each Char8Array has
//   value    `extra` records, in the order of the line: see SniffRecord
//   extra    how many, 1 or more
//   address  bytes of the line that are missing between the message before and this one, because the listener did not take its messages
//            or the server could not keep up. 0: none. At most 2^31 - 1: what is more is told in the next message.
// A batch waits for others some 20 ms at most, so a slow line gives small messages, and a fast one large ones.
//
// The replies to start and stop are Int32 with
//   status   sniffStatusOK; sniffStatusNotListening: a stop by a client that does not listen; sniffStatusError: a cmd that is neither
//   address  of stop: bytes that were seen before the stop and are missing at the end
//
// A client that starts again while it listens starts anew: records go to the new request from then on, and none is given twice. A
// client that goes away need not stop. One that does not take its messages costs itself bytes, and nobody else anything: neither the
// line nor other listeners wait for it. When the server ends, the listener gets its ConnectMessage.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <mpf/schema/message.h>

namespace mpf::serial {

// NOLINTBEGIN(readability-identifier-naming): named as the words of serial_server.h are

// The name of a serial server's listening service is its own and this.
inline constexpr std::string_view sniffSuffix = ".sniff";

// `cmd` of an Int32 message.
inline constexpr std::int32_t cmdSniffStart = 1;
inline constexpr std::int32_t cmdSniffStop = 2;

// `status` of its reply.
inline constexpr std::int32_t sniffStatusOK = 0;
inline constexpr std::int32_t sniffStatusNotListening = 1;
inline constexpr std::int32_t sniffStatusError = 3;

// NOLINTEND(readability-identifier-naming)

// What happened on the line, and the byte that says so in a record.
enum class SniffKind : char {
  sent = 'T',
  received = 'R',
  damaged = 'r',      // received, with a parity or framing error: the value is what arrived
  breakSignal = 'B',  // a break was received: the value is 0
};

// One byte of the line.
//
//   | at: 8 bytes, little-endian | kind | value |     10 bytes, no padding
struct SniffRecord {
  static constexpr std::size_t kBytes = 10;

  std::int64_t atNs = 0;  // CLOCK_MONOTONIC of the server's host, when the kernel had taken the byte or given it
  SniffKind kind = SniffKind::sent;
  std::uint8_t value = 0;

  void write(std::span<char, kBytes> bytes) const noexcept;
  // nullopt when the kind is none that this program knows.
  [[nodiscard]] static std::optional<SniffRecord> tryRead(std::span<const char, kBytes> bytes) noexcept;

  friend bool operator==(const SniffRecord&, const SniffRecord&) = default;
};

// The records of a reply; nullopt when it is no such reply: `extra` and the size disagree, or a kind is unknown.
[[nodiscard]] std::optional<std::vector<SniffRecord>> tryReadRecords(const Char8ArrayMessage& reply);

}  // namespace mpf::serial
