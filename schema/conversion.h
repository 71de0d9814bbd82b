// SPDX-License-Identifier: MIT
// Conversion: between a message in shared memory and the Envelope of message.capnp, which is sent
// to another host.
//
// Both directions use the descriptions in message_types.h by field name; no type has code of its
// own. All bits of numbers are kept, also NaN payloads and -0.0. An unknown enum value of a newer
// peer is kept as a number.
//
// Threads  any number of callers at a time, each with its own messages.
// Trust    an Envelope may contain anything. Invalid data is refused with an error that names type
//          and field; nothing larger than the limit is allocated.
#pragma once

#include <capnp/message.h>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include <mpf/message.h>

#include "schema/message.capnp.h"

namespace mpf {

struct ConversionLimits {
  std::size_t maxValueBytes = std::size_t{64} << 20;  // of the elements of an array

  // Options for the MessageReader of one Envelope, which permit little more than these limits.
  [[nodiscard]] capnp::ReaderOptions readerOptions() const noexcept;
};

enum class ConversionFault {
  none,
  unknownType,  // a message of a newer peer: refuse it and keep the connection
  tooLarge,     // above the limit: refuse the message
  unsound,      // the body in memory is not a valid message
  malformed,    // the peer sent invalid data: do not use the rest of it either
};

struct ConversionError {
  ConversionFault fault = ConversionFault::none;
  std::string text;  // "float64Array.value: 134217728 bytes, the limit is 67108864"
};

// Fills `envelope`. Returns false with `error` set; the envelope is then incomplete.
[[nodiscard]] bool tryToWire(const Message& message, wire::Envelope::Builder envelope,
                             const ConversionLimits& limits, ConversionError& error);

// Creates the message of `envelope`.
//   allocate  allocates the memory of an array; by default on the heap
//   returns   nullopt with `error` set when the envelope is invalid
//   throws    std::bad_alloc
[[nodiscard]] std::optional<Message> tryFromWire(
    wire::Envelope::Reader envelope, const ConversionLimits& limits, ConversionError& error,
    const std::function<BodyBytes(std::size_t)>& allocate = allocateHeapBody);

}  // namespace mpf
