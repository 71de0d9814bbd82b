// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/sniff_source.h"

#include <utility>
#include <vector>

namespace mpf {
namespace {

using serial::SniffKind;
using serial::SniffRecord;

SniffKind kindOf(const PeekedByte& byte) noexcept {
  if (byte.fault == LineFault::breakSignal) return SniffKind::breakSignal;
  if (byte.fault != LineFault::none) return SniffKind::damaged;
  return byte.direction == ByteDirection::sent ? SniffKind::sent : SniffKind::received;
}

}  // namespace

SniffSource sniffSourceOf(SerialPort& port) {
  return [&port](std::function<void(std::span<const SniffBytes>)> show) {
    auto tap = port.attachTap([show = std::move(show), records = std::vector<SniffBytes>()](
                                  std::span<const PeekedByte> bytes) mutable {
      records.resize(bytes.size());
      for (std::size_t i = 0; i < bytes.size(); ++i)
        SniffRecord{bytes[i].atNs, kindOf(bytes[i]), bytes[i].value}.write(records[i]);
      show(records);
    });
    return std::make_shared<PeekTap>(std::move(tap));
  };
}

}  // namespace mpf
