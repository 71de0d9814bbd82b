// SPDX-License-Identifier: MIT
// The messages between a GPIB server and the listeners of its bus. They are those of
// <mpf/serial_sniff.h>, to the server "<GPIB server>.sniff", with other records:
//
//   listener                      server "<GPIB server>.sniff"
//     Int32 cmd=cmdSniffStart ──►
//                             ◄── Int32 status=sniffStatusOK
//                             ◄── Char8Array extra=3 address=0 value=| UNL | TAG 22 | '-' |
//     Int32 cmd=cmdSniffStop  ──►
//                             ◄── Int32 status=sniffStatusOK address=0    the last message
//
// A controller that sends the commands of the bus automatically (Prologix, USBTMC) shows the data
// only.
//
// Source   manual, "Diagnostic Aids": gpibSniff. The messages are those of this project.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <mpf/message_of.h>
#include <mpf/serial_sniff.h>

namespace mpf::gpib {

// One byte of the bus.
//
//   | at: 8 bytes, little-endian | flags | value |     10 bytes, no padding
struct SniffRecord {
  static constexpr std::size_t kBytes = serial::SniffRecord::kBytes;
  enum Flag : std::uint8_t {
    kReceived = 1,  // by the controller; else it has sent the byte
    kAttention = 2,  // ATN: a command, not data
    kEnd = 4,  // EOI: the last byte of a message
  };

  // [ns] CLOCK_MONOTONIC of the server's host when the controller had handled the byte.
  std::int64_t atNs = 0;
  std::uint8_t flags = 0;  // OR of Flag
  std::uint8_t value = 0;  // the byte

  [[nodiscard]] bool has(Flag flag) const noexcept { return (flags & flag) != 0; }
  // The record as it is in a message.
  void write(std::span<char, kBytes> bytes) const noexcept;
  // Returns nullopt when a flag is unknown.
  [[nodiscard]] static std::optional<SniffRecord> tryRead(
      std::span<const char, kBytes> bytes) noexcept;

  friend bool operator==(const SniffRecord&, const SniffRecord&) = default;
};

// Returns the records of a Char8Array message; nullopt when it is invalid: its size does not match
// `extra`, or a flag is unknown. Throws std::bad_alloc.
[[nodiscard]] std::optional<std::vector<SniffRecord>> tryReadRecords(
    const Char8ArrayMessage& reply);

}  // namespace mpf::gpib
