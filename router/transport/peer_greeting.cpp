// SPDX-License-Identifier: MIT
#include "router/transport/peer_greeting.h"

#include <algorithm>
#include <fmt/format.h>

#include "router/protocol_error.h"
#include "router/transport/kj_text.h"

namespace mpf::router {

PeerGreeting PeerGreeting::read(wire::Greeting::Reader greeting) {
  if (greeting.getProtocolMajor() != wire::PROTOCOL_MAJOR) {
    throw ProtocolError(FarewellCode::VERSION,
                        fmt::format("the peer has protocol {}.{}, this router {}.x: install the "
                                    "same release of mpf-router on both hosts",
                                    greeting.getProtocolMajor(), greeting.getProtocolMinor(),
                                    wire::PROTOCOL_MAJOR));
  }
  if (greeting.getMaxFrameBytes() < kLeastFrameBytes) {
    throw ProtocolError(FarewellCode::PROTOCOL,
                        fmt::format("maxFrameBytes is {}; at least {} are required",
                                    greeting.getMaxFrameBytes(), kLeastFrameBytes));
  }
  return {.router = displayText(greeting.getRouter()),
          .program = displayText(greeting.getProgram()),
          .maxFrameBytes = greeting.getMaxFrameBytes(),
          .maxMessageBytes = greeting.getMaxMessageBytes(),
          .maxClients = greeting.getMaxClients()};
}

std::uint64_t PeerGreeting::maxMessageBytesWith(const Limits& limits) const noexcept {
  constexpr std::uint64_t kFrameOverhead = 1024;
  if (!hasArrived()) return 0;
  return std::min<std::uint64_t>(
      {limits.maxMessageBytes, maxMessageBytes, maxFrameBytes - kFrameOverhead});
}

std::uint64_t maxFrameBytes(const Limits& limits) noexcept {
  constexpr std::uint64_t kFields = std::uint64_t{1} << 20;  // for everything but the bodies
  return std::max<std::uint64_t>(limits.maxMessageBytes, limits.bufferBytes) + kFields;
}

void fillLimits(wire::Greeting::Builder greeting, const Limits& limits) {
  greeting.setProtocolMajor(wire::PROTOCOL_MAJOR);
  greeting.setProtocolMinor(wire::PROTOCOL_MINOR);
  greeting.setMaxFrameBytes(maxFrameBytes(limits));
  greeting.setMaxMessageBytes(limits.maxMessageBytes);
  greeting.setDeadTimeMs(static_cast<std::uint32_t>(limits.deadTime.count()));
}

}  // namespace mpf::router
