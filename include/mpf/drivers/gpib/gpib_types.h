// SPDX-License-Identifier: MIT
// The values that a GPIB bus, its controllers and its users exchange: addresses, how an operation
// ended, what ends a read, and a byte as a peek handler sees it.
//
// Threads  plain values: share them as you share an int.
// Trust    an instrument may send any bytes at any time, or stop in the middle of a byte: an
//          operation ends with a status at its deadline.
// Source   IEEE 488.1; IEEE 488.2 for the names of the common operations.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace mpf {

// The address of an instrument: primary 0 to 30, and a secondary address 0 to 30 when the
// instrument has one.
struct GpibAddress {
  static constexpr std::uint8_t kHighest = 30;

  std::uint8_t primary = 0;
  std::optional<std::uint8_t> secondary{};

  auto operator<=>(const GpibAddress&) const = default;

  // Whether both parts are in their range.
  [[nodiscard]] bool isValid() const noexcept {
    return primary <= kHighest && secondary.value_or(0) <= kHighest;
  }

  // From one number, as EPICS links and asyn write addresses: 0 to 30 is a primary address; from
  // 100 on, 100 * primary + secondary. Empty when the number is no address.
  [[nodiscard]] static std::optional<GpibAddress> fromNumber(std::int32_t number) noexcept;
  // The inverse of fromNumber(), except for primary address 0 with a secondary address, which has
  // no number: then the primary address alone.
  [[nodiscard]] std::int32_t number() const noexcept;
};
// As people write it: "22", or "22.5" with a secondary address.
[[nodiscard]] std::string toString(const GpibAddress& address);

// How an operation ended.
enum class GpibStatus : std::uint8_t {
  success,
  timeout,  // the deadline has passed: nobody answered, or the bus was busy until then
  noListener,  // no instrument accepted the bytes: none is at the address, or it is off
  failure,  // the controller or the bus failed
  unsupported,  // this kind of controller cannot do the operation
  leased,  // another user holds the bus
};
[[nodiscard]] const char* toString(GpibStatus status) noexcept;

struct GpibResult {
  GpibStatus status = GpibStatus::success;
  // A sentence for people: what failed, on which object, why, and what to do. Empty for success.
  std::string reason{};

  [[nodiscard]] bool ok() const noexcept { return status == GpibStatus::success; }
};

// What ends a read. END (the last byte with EOI) always ends it.
struct GpibReadLimits {
  std::size_t maxBytes = 0;  // at least 1
  std::optional<std::uint8_t> endOfString{};  // this byte ends the read; it is part of the data
};
struct GpibReadResult : GpibResult {
  std::vector<std::uint8_t> data{};  // with any status: the bytes that were read
  bool sawEnd = false;  // the last byte of `data` came with EOI
};

struct GpibPollResult : GpibResult {
  std::uint8_t statusByte = 0;
};
// Bit of a status byte: this instrument requests service.
inline constexpr std::uint8_t kGpibRequestsService = 0x40;

// From the point of view of the controller.
enum class GpibDirection : std::uint8_t { sent, received };

// A byte on the bus as the controller saw it.
struct GpibPeekedByte {
  std::int64_t atNs = 0;  // CLOCK_MONOTONIC [ns], when the controller had handled it
  std::uint8_t value = 0;
  bool attention = false;  // ATN: a command (address, poll, clear ...), not data
  bool endOrIdentify = false;  // EOI: the last byte of a message
  GpibDirection direction = GpibDirection::sent;

  bool operator==(const GpibPeekedByte&) const = default;
};
// Receives the bytes in the order of the bus: at least one. The span is valid during the call only.
// Must not block, throw or call the bus.
using GpibPeekHandler = std::function<void(std::span<const GpibPeekedByte>)>;

}  // namespace mpf
