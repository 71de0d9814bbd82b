// SPDX-License-Identifier: MIT
// Envelope: the fields that a ring carries beside the body of a message, and the parts of them that
// functions need. The parts are small, so that they are passed in registers.
//
// Threads  plain data.
// Trust    copies of what a peer has written: any value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include <mpf/detail/copy_words.h>

#include "shm/layout.h"

namespace mpf {

// CLOCK_MONOTONIC in units of 16 ns, low 32 bits, never 0: fits into a slot and spans a minute.
struct Tick {
  [[nodiscard]] static std::uint32_t of(std::int64_t ns) noexcept {
    return static_cast<std::uint32_t>(ns >> 4) | 1u;
  }
  // The tick of a message that is sent at this time; 0 if `ns` is 0: the message is not timed.
  [[nodiscard]] static std::uint32_t ofSample(std::int64_t ns) noexcept {
    if (ns == 0) [[likely]]
      return 0;
    return of(ns);
  }
  [[nodiscard]] static std::int64_t nsSince(std::uint32_t tick, std::int64_t nowNs) noexcept {
    return static_cast<std::int64_t>(of(nowNs) - tick) * 16;
  }
};

// The part of an envelope that says how to read the body.
struct BodyFields {
  std::uint16_t type{};
  std::uint8_t flags{};  // layout::kSlot...
  std::uint32_t bodyBytes{};
};

// The part of an envelope that a reply copies from its request.
struct RequestMarks {
  // clientType, and in the upper half clientExtra: as two numbers they would go through memory on
  // their way into one register
  std::uint64_t ofClient{};
  std::uint32_t requestId{};

  [[nodiscard]] std::int32_t clientType() const noexcept {
    return static_cast<std::int32_t>(ofClient);
  }
  [[nodiscard]] std::int32_t clientExtra() const noexcept {
    return static_cast<std::int32_t>(ofClient >> 32);
  }
};

// The fields that are sent with a body. The ring does not interpret `type`, `clientType` or
// `clientExtra`.
struct Envelope {
  std::uint16_t type{};
  std::uint8_t flags{};  // layout::kSlot...
  std::uint32_t bodyBytes{};
  std::uint32_t requestId{};
  std::int32_t clientType{};
  std::int32_t clientExtra{};
  std::uint32_t sentTick{};
  std::int64_t timeNs{};  // requests: the deadline; replies: the time stamp; 0: none

  [[nodiscard]] BodyFields body() const noexcept { return {type, flags, bodyBytes}; }
  [[nodiscard]] RequestMarks marks() const noexcept {
    const auto low = detail::widened(static_cast<std::uint32_t>(clientType));
    const auto high = detail::widened(static_cast<std::uint32_t>(clientExtra));
    return {low | high << 32, requestId};
  }
};

// An envelope as a first slot holds it, in words of 64 bits: the number of stores limits the rate
// of messages.
struct EnvelopeWords {
  std::uint64_t body, request, client, timeNs;

  // `slots`: of the message; `bodyBytes` replaces that of the envelope.
  [[nodiscard, gnu::always_inline]] static EnvelopeWords of(const Envelope& envelope,
                                                            std::uint32_t slots,
                                                            std::uint32_t bodyBytes) noexcept {
    using detail::joined;
    static_assert(offsetof(layout::Slot, slots) == offsetof(layout::Slot, type) + 2 &&
                  offsetof(layout::Slot, flags) == offsetof(layout::Slot, type) + 3 &&
                  offsetof(layout::Slot, bodyBytes) == offsetof(layout::Slot, type) + 4 &&
                  offsetof(layout::Slot, clientType) == offsetof(layout::Slot, requestId) + 4 &&
                  offsetof(layout::Slot, sentTick) == offsetof(layout::Slot, clientExtra) + 4);
    return {
        joined(joined(envelope.type, static_cast<std::uint8_t>(slots), envelope.flags), bodyBytes),
        joined(envelope.requestId, static_cast<std::uint32_t>(envelope.clientType)),
        joined(static_cast<std::uint32_t>(envelope.clientExtra), envelope.sentTick),
        static_cast<std::uint64_t>(envelope.timeNs)};
  }
  // A copy of those in a slot. Each is read once: a peer may change them.
  [[nodiscard, gnu::always_inline]] static EnvelopeWords in(const layout::Slot& first) noexcept {
    const auto word = [&](std::size_t at) {
      std::uint64_t value = 0;
      std::memcpy(&value, reinterpret_cast<const std::byte*>(&first) + at, sizeof value);
      return detail::alone(value);
    };
    return {word(offsetof(layout::Slot, type)), word(offsetof(layout::Slot, requestId)),
            word(offsetof(layout::Slot, clientExtra)), word(offsetof(layout::Slot, deadlineNs))};
  }
  // The word `body` of a message whose body fills its one slot.
  [[nodiscard]] static std::uint64_t fullSlot(std::uint16_t type, std::uint8_t flags) noexcept {
    return of({.type = type, .flags = flags}, 1, layout::kFirstSlotBodyBytes).body;
  }
  [[nodiscard]] std::uint32_t requestId() const noexcept { return detail::firstOf(request); }
  [[nodiscard]] std::int32_t clientType() const noexcept {
    return static_cast<std::int32_t>(detail::secondOf(request));
  }
  [[nodiscard]] std::int32_t clientExtra() const noexcept {
    return static_cast<std::int32_t>(detail::firstOf(client));
  }
  [[nodiscard]] std::uint32_t sentTick() const noexcept { return detail::secondOf(client); }
  // The word `client` with another tick.
  [[nodiscard]] std::uint64_t clientWith(std::uint32_t tick) const noexcept {
    return detail::joined(detail::firstOf(client), tick);
  }
  // Whether the client has marked both messages alike, and they have the same time.
  [[nodiscard]] bool hasMarksOf(const EnvelopeWords& other) const noexcept {
    return detail::secondOf(request) == detail::secondOf(other.request) &&
           clientWith(0) == other.clientWith(0) && timeNs == other.timeNs;
  }
  [[gnu::always_inline]] void copyTo(layout::Slot& first) const noexcept {
    auto* const slot = reinterpret_cast<std::byte*>(&first);
    std::memcpy(slot + offsetof(layout::Slot, type), &body, sizeof body);
    std::memcpy(slot + offsetof(layout::Slot, requestId), &request, sizeof request);
    std::memcpy(slot + offsetof(layout::Slot, clientExtra), &client, sizeof client);
    std::memcpy(slot + offsetof(layout::Slot, deadlineNs), &timeNs, sizeof timeNs);
  }
};

// A copy of the body bytes in a first slot, in words that the compiler keeps in registers.
struct FirstBody {
  std::uint64_t first, second, third;

  [[nodiscard]] static FirstBody of(const std::byte* bytes) noexcept {
    const auto word = [&](std::size_t at) {
      std::uint64_t value = 0;
      std::memcpy(&value, bytes + at * sizeof value, sizeof value);
      asm("" : "+r"(value));  // read once: a peer may change the bytes
      return value;
    };
    return {word(0), word(1), word(2)};
  }
  void copyTo(std::byte* bytes) const noexcept {
    std::memcpy(bytes, &first, sizeof first);
    std::memcpy(bytes + sizeof first, &second, sizeof second);
    std::memcpy(bytes + 2 * sizeof first, &third, sizeof third);
  }
};
static_assert(sizeof(FirstBody) == layout::kFirstSlotBodyBytes);

}  // namespace mpf
