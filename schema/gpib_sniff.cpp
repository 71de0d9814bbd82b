// SPDX-License-Identifier: MIT
#include <mpf/gpib_sniff.h>

#include "schema/sniff_records.h"

namespace mpf::gpib {
namespace {

constexpr std::uint8_t kAllFlags =
    SniffRecord::kReceived | SniffRecord::kAttention | SniffRecord::kEnd;

}  // namespace

void SniffRecord::write(std::span<char, kBytes> bytes) const noexcept {
  writeSniffTime(atNs, bytes);
  bytes[kSniffTimeBytes] = static_cast<char>(flags);
  bytes[kSniffTimeBytes + 1] = static_cast<char>(value);
}

std::optional<SniffRecord> SniffRecord::tryRead(std::span<const char, kBytes> bytes) noexcept {
  const auto flags = static_cast<std::uint8_t>(bytes[kSniffTimeBytes]);
  if ((flags & ~kAllFlags) != 0) return std::nullopt;
  return SniffRecord{readSniffTime(bytes), flags,
                     static_cast<std::uint8_t>(bytes[kSniffTimeBytes + 1])};
}

std::optional<std::vector<SniffRecord>> tryReadRecords(const Char8ArrayMessage& reply) {
  return tryReadSniffRecords<SniffRecord>(reply);
}

}  // namespace mpf::gpib
