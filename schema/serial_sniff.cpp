// SPDX-License-Identifier: MIT
#include <mpf/serial_sniff.h>

namespace mpf::serial {
namespace {

constexpr std::size_t kTimeBytes = 8;

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
  auto rest = static_cast<std::uint64_t>(atNs);
  for (auto& byte : bytes.first<kTimeBytes>()) {
    byte = static_cast<char>(rest & 0xff);
    rest >>= 8;
  }
  bytes[kTimeBytes] = static_cast<char>(kind);
  bytes[kTimeBytes + 1] = static_cast<char>(value);
}

std::optional<SniffRecord> SniffRecord::tryRead(std::span<const char, kBytes> bytes) noexcept {
  std::uint64_t at = 0;
  for (std::size_t i = 0; i < kTimeBytes; ++i)
    at |= std::uint64_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
  const auto kind = static_cast<SniffKind>(bytes[kTimeBytes]);
  if (!isKnown(kind)) return std::nullopt;
  return SniffRecord{static_cast<std::int64_t>(at), kind,
                     static_cast<std::uint8_t>(bytes[kTimeBytes + 1])};
}

std::optional<std::vector<SniffRecord>> tryReadRecords(const Char8ArrayMessage& reply) {
  const auto value = reply.value();
  std::vector<SniffRecord> records;
  for (std::size_t at = 0; at + SniffRecord::kBytes <= value.size(); at += SniffRecord::kBytes) {
    const auto record = SniffRecord::tryRead(value.subspan(at).first<SniffRecord::kBytes>());
    if (!record) return std::nullopt;
    records.push_back(*record);
  }
  const auto extra = reply->extra;
  if (extra < 0 || records.size() != static_cast<std::size_t>(extra) ||
      records.size() * SniffRecord::kBytes != value.size())
    return std::nullopt;
  return records;
}

}  // namespace mpf::serial
