// SPDX-License-Identifier: MIT
// Four bare processes: what a round trip through two routers costs if no process handles a message.
// On each side one process sleeps at once until a word in shared memory changes, and a carrier
// passes frames on between these words and a TCP connection. As a router does during traffic, it
// polls its word and the connection, and yields the processor. Meant for one CPU on each side.
//
//   server ═ two words ═ carrier ═══ TCP ═══ carrier ═ two words ═ client
//
// The frames are as long as those of routers; their bytes mean nothing.
#pragma once

#include <cstddef>
#include <memory>

#include "benchmarks/peers/peer.h"
#include "benchmarks/remote/surroundings.h"

namespace mpf::bench {

inline constexpr std::size_t kBareScratchBytes = 4096;  // Workload::scratchBytes

// Bytes of a frame that a router writes for Int32 messages: its head, and each of them.
[[nodiscard]] constexpr std::size_t bareFrameBytes(std::size_t messages) noexcept {
  return 32 + 96 * messages;
}

// send() posts a frame; receive() waits until it has come back. One frame is outstanding at a time:
// receive() follows each send().
[[nodiscard]] std::unique_ptr<Peer> makeBarePeer(const Surroundings& between,
                                                 std::size_t frameBytes);

}  // namespace mpf::bench
