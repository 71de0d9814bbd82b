// SPDX-License-Identifier: MIT
// Sniff records: what <mpf/serial_sniff.h> and <mpf/gpib_sniff.h> have in common: a time, and two
// bytes that each of them defines.
//
// Threads  plain functions.
// Trust    any bytes may come from the peer.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <mpf/message_of.h>
#include <mpf/serial_sniff.h>

namespace mpf {

inline constexpr std::size_t kSniffTimeBytes = 8;

inline void writeSniffTime(std::int64_t atNs, std::span<char> bytes) noexcept {
  auto rest = static_cast<std::uint64_t>(atNs);
  for (auto& byte : bytes.first<kSniffTimeBytes>()) {
    byte = static_cast<char>(rest & 0xff);
    rest >>= 8;
  }
}

[[nodiscard]] inline std::int64_t readSniffTime(std::span<const char> bytes) noexcept {
  std::uint64_t at = 0;
  for (std::size_t i = 0; i < kSniffTimeBytes; ++i)
    at |= std::uint64_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
  return static_cast<std::int64_t>(at);
}

// The records of a message; nullopt when one is invalid or their number is not that of `extra`.
template <class Record>
[[nodiscard]] std::optional<std::vector<Record>> tryReadSniffRecords(
    const Char8ArrayMessage& reply) {
  const auto value = reply.value();
  std::vector<Record> records;
  for (std::size_t at = 0; at + Record::kBytes <= value.size(); at += Record::kBytes) {
    const auto record = Record::tryRead(value.subspan(at).template first<Record::kBytes>());
    if (!record) return std::nullopt;
    records.push_back(*record);
  }
  const auto extra = reply->extra;
  if (extra < 0 || records.size() != static_cast<std::size_t>(extra) ||
      records.size() * Record::kBytes != value.size())
    return std::nullopt;
  return records;
}

}  // namespace mpf
