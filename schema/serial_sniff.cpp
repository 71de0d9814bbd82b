// SPDX-License-Identifier: MIT
#include <mpf/serial_sniff.h>

#include "schema/sniff_records.h"

namespace mpf::serial {
namespace {

bool isKnown(SniffKind kind) noexcept {
  switch (kind) {
    case SniffKind::sent:
    case SniffKind::received:
    case SniffKind::damaged:
    case SniffKind::breakSignal:
      return true;
  }
  return false;
}

}  // namespace

void SniffRecord::write(std::span<char, kBytes> bytes) const noexcept {
  writeSniffTime(atNs, bytes);
  bytes[kSniffTimeBytes] = static_cast<char>(kind);
  bytes[kSniffTimeBytes + 1] = static_cast<char>(value);
}

std::optional<SniffRecord> SniffRecord::tryRead(std::span<const char, kBytes> bytes) noexcept {
  const auto kind = static_cast<SniffKind>(bytes[kSniffTimeBytes]);
  if (!isKnown(kind)) return std::nullopt;
  return SniffRecord{readSniffTime(bytes), kind,
                     static_cast<std::uint8_t>(bytes[kSniffTimeBytes + 1])};
}

std::optional<std::vector<SniffRecord>> tryReadRecords(const Char8ArrayMessage& reply) {
  return tryReadSniffRecords<SniffRecord>(reply);
}

}  // namespace mpf::serial
