// SPDX-License-Identifier: MIT
// What the measurements of ours have in common.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <mpf/message_server.h>

#include "benchmarks/peers/peer.h"

namespace mpf::bench {

inline constexpr const char* kMpf = "MPF";
inline constexpr const char* kServer = "bench";
inline constexpr auto kConnectLimit = std::chrono::seconds(10);

// Where server and client of ours meet.
struct MpfPlaces {
  std::string serverBackplane;
  std::string clientBackplane;  // another one: a pair of routers joins both
  std::int32_t location = 0;
  int queueSize = 256;
};

// Ours: 4 bytes are an Int32 message; more an array of type Array, which the client makes in shared
// memory and the server replies with. Instances: Char8Array, Int32Array, Float64Array.
template <ArrayBody Array>
[[nodiscard]] std::unique_ptr<Peer> makeMpfPeer(const PeerOptions& options,
                                                const MpfPlaces& places);

[[nodiscard]] WaitMode waitMode(Mode mode) noexcept;
[[nodiscard]] ServerOptions serverOptions(Mode mode);
// Begins the name of every backplane, queue and socket of a run; its pid follows.
inline constexpr const char* kRunPrefix = "mpf-bench-";
// Each link takes descriptors: lets this process, and what it starts, have as many as it may.
void raiseDescriptorLimit() noexcept;
// Pages of shared memory that the segments of a backplane occupy.
[[nodiscard]] double occupiedBytes(const Backplane& backplane);
// Removes what killed processes left on backplanes whose names begin so. What belongs to a living
// process stays.
void removeBackplanes(const std::string& prefix) noexcept;

}  // namespace mpf::bench
