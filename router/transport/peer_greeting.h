// SPDX-License-Identifier: MIT
// PeerGreeting: the limits that two routers tell each other in the first item of a connection.
//
// Threads  any.
// Trust    a greeting of another major version, or with a frame size below kLeastFrameBytes, is a
//          ProtocolError.
#pragma once

#include <cstdint>
#include <string>

#include "router/config/router_config.h"
#include "schema/router.capnp.h"

namespace mpf::router {

// The frame size that each side must accept, and the largest size of a greeting.
inline constexpr std::uint64_t kLeastFrameBytes = std::uint64_t{64} << 10;

// The fields of a peer's greeting.
struct PeerGreeting {
  std::string router;
  std::string program;
  std::uint64_t maxFrameBytes = 0;  // 0: the greeting has not arrived
  std::uint64_t maxMessageBytes = 0;
  std::uint32_t maxClients = 0;

  //   throws  ProtocolError
  [[nodiscard]] static PeerGreeting read(wire::Greeting::Reader greeting);
  [[nodiscard]] bool hasArrived() const noexcept { return maxFrameBytes != 0; }
  // The largest body that both sides accept.
  [[nodiscard]] std::uint64_t maxMessageBytesWith(const Limits& limits) const noexcept;
};

// The longest frame that a router with these limits accepts.
[[nodiscard]] std::uint64_t maxFrameBytes(const Limits& limits) noexcept;

// Fills in the fields of this router's greeting that follow from its version and its limits.
void fillLimits(wire::Greeting::Builder greeting, const Limits& limits);

}  // namespace mpf::router
