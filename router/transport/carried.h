// SPDX-License-Identifier: MIT
// Carried: a message that one router sends to another as an item of a frame.
//
// Threads  that of the event loop.
#pragma once

#include <algorithm>
#include <cstdint>

#include <mpf/clock.h>
#include <mpf/message_of.h>

#include "schema/conversion.h"

namespace mpf::router {

struct Carried {
  bool isRequest = false;
  bool isFirst = false;  // of a reply: it ends the request
  std::uint32_t client = 0;
  std::uint32_t requestId = 0;
  Deadline takeBefore = Deadline::never();  // of a request
  Message message;  // of a reply: its getMissed() is sent, too
};

// The bytes that a reply takes from its client's window (router.capnp, Credit): those of its
// elements, and a fixed number for the rest.
inline constexpr std::uint32_t kWindowOverheadBytes = 64;
[[nodiscard]] inline std::uint32_t windowBytesOf(const Message& reply) noexcept {
  return kWindowOverheadBytes + reply.arrayLength() * layoutOf(reply.getType()).elementBytes;
}

// The largest size of a body without its elements. Limits on the wire count elements, those in
// shared memory count whole bodies.
inline constexpr std::uint64_t kMaxHeaderBytes = [] {
  std::uint64_t most = 0;
  for (std::uint16_t type = 1; layoutOf(static_cast<MessageType>(type)).headerBytes != 0; ++type) {
    most = std::max<std::uint64_t>(most, layoutOf(static_cast<MessageType>(type)).headerBytes);
  }
  return most;
}();

}  // namespace mpf::router
