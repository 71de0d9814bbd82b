// SPDX-License-Identifier: MIT
// Functions that all measurements of MPF share.
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

// The backplanes and the location of an MPF server and its client.
struct MpfPlaces {
  std::string serverBackplane;
  std::string clientBackplane;  // if it differs, a pair of routers joins both
  std::int32_t location = 0;
  int queueSize = 256;  // the ring of replies then fits the first-level cache
  bool inBatches = false;  // the server sends values with replyMany()
  // The client sends values with sendMany() and receives them with onValues(); the server handles
  // several requests together.
  bool inRuns = false;
};

// The MPF peer. 4 bytes are an Int32 message; more bytes are an array of type Array, which the
// client allocates in shared memory and the server sends back. Instances: Char8Array, Int32Array,
// Float64Array.
template <ArrayBody Array>
[[nodiscard]] std::unique_ptr<Peer> makeMpfPeer(const PeerOptions& options,
                                                const MpfPlaces& places);

[[nodiscard]] WaitMode waitMode(Mode mode) noexcept;
[[nodiscard]] ServerOptions serverOptions(Mode mode);
// The names of all backplanes, queues and sockets of a run begin with this prefix and its pid.
inline constexpr const char* kRunPrefix = "mpf-bench-";
// Raises the soft limit of descriptors of this process to its hard limit, since each link needs
// descriptors. Processes that it starts inherit the limit.
void raiseDescriptorLimit() noexcept;
// Bytes of shared memory that the segments of a backplane occupy.
[[nodiscard]] double occupiedBytes(const Backplane& backplane);
// Removes what dead processes left on backplanes whose names begin with `prefix`. The segments of
// living processes stay.
void removeBackplanes(const std::string& prefix) noexcept;

}  // namespace mpf::bench
