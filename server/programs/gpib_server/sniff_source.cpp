// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/sniff_source.h"

#include <utility>
#include <vector>

#include <mpf/gpib_sniff.h>

namespace mpf {
namespace {

gpib::SniffRecord recordOf(const GpibPeekedByte& byte) noexcept {
  using Record = gpib::SniffRecord;
  const bool isReceived = byte.direction == GpibDirection::received;
  const int flags = (isReceived ? Record::kReceived : 0) |
                    (byte.attention ? Record::kAttention : 0) |
                    (byte.endOrIdentify ? Record::kEnd : 0);
  return {byte.atNs, static_cast<std::uint8_t>(flags), byte.value};
}

}  // namespace

SniffSource sniffSourceOf(GpibBus& bus) {
  return [&bus](std::function<void(std::span<const SniffBytes>)> show) {
    auto tap = bus.attachTap([show = std::move(show), records = std::vector<SniffBytes>()](
                                 std::span<const GpibPeekedByte> bytes) mutable {
      records.resize(bytes.size());
      for (std::size_t i = 0; i < bytes.size(); ++i) recordOf(bytes[i]).write(records[i]);
      show(records);
    });
    return std::make_shared<GpibBus::Subscription>(std::move(tap));
  };
}

}  // namespace mpf
