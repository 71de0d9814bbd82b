// SPDX-License-Identifier: MIT
// Four bare processes: the least that a round trip through two routers can cost. On each side one
// process sleeps until a word in shared memory changes, and another carries frames between that
// word and a TCP connection. As routers do during traffic, it polls both and yields the processor.
//
//   server ─ word ─ carrier ═══ TCP ═══ carrier ─ word ─ client
//
// The frames are as long as those of MPF, but nothing writes or reads the messages in them.
#pragma once

#include <cstddef>
#include <memory>

#include "benchmarks/peers/peer.h"
#include "benchmarks/remote/surroundings.h"

namespace mpf::bench {

inline constexpr std::size_t kBareScratchBytes = 4096;  // Workload::scratchBytes

// The peer's send() posts a frame, and receive() waits until it has come back.
[[nodiscard]] std::unique_ptr<Peer> makeBarePeer(const Surroundings& between,
                                                 std::size_t frameBytes);

}  // namespace mpf::bench
