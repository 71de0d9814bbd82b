// SPDX-License-Identifier: MIT
// Conversion: a message in shared memory <-> the Envelope of message.capnp, for the way to another host.
//
// Both directions follow the descriptions in message_types.h by name; no type has code of its own. All bits of numbers survive: NaN
// payloads, -0.0. An enum's value that only a newer peer knows is carried on as its number.
//
// Trust    a reader may hold anything. What does not fit is refused with an error that names type and field; nothing larger than the
//          limit is allocated.
#pragma once

#include <capnp/message.h>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include <mpf/schema/message.capnp.h>
#include <mpf/schema/message.h>

namespace mpf {

struct ConversionLimits {
  std::size_t maxValueBytes = std::size_t{64} << 20;  // of an array's elements

  // For the MessageReader of one Envelope: lets through what these limits allow, little more.
  [[nodiscard]] capnp::ReaderOptions readerOptions() const noexcept;
};

enum class ConversionFault {
  none,
  unknownType,  // a newer peer's message: refuse it, the connection is sound
  tooLarge,     // above the limit: refuse it
  unsound,      // our side's body is no such message
  malformed,    // the peer's bytes are no such message: do not believe the rest of them either
};

struct ConversionError {
  ConversionFault fault = ConversionFault::none;
  std::string text;  // "float64Array.value: 134217728 bytes, the limit is 67108864"
};

// Fills `envelope`. False: see `error`; the envelope holds half a message.
[[nodiscard]] bool tryToWire(const Message& message, wire::Envelope::Builder envelope, const ConversionLimits& limits,
                             ConversionError& error);

// Makes the message that `envelope` holds; arrays on the heap. nullopt: see `error`. Throws std::bad_alloc.
//   allocate  gives the memory for an array, as allocateHeapBody() does
[[nodiscard]] std::optional<Message> tryFromWire(wire::Envelope::Reader envelope, const ConversionLimits& limits, ConversionError& error,
                                                 const std::function<BodyBytes(std::size_t)>& allocate = allocateHeapBody);

}  // namespace mpf
