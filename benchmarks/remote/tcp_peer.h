// SPDX-License-Identifier: MIT
// Raw TCP: what two programs reach that need no message system: plain sockets with TCP_NODELAY, and
// a server that echoes.
#pragma once

#include <cstddef>
#include <memory>

#include "benchmarks/peers/peer.h"
#include "benchmarks/remote/surroundings.h"

namespace mpf::bench {

struct TcpOptions {
  Surroundings between;
  // of one write, and of what the server reads before it writes the same back
  std::size_t unitBytes = 4;
  // while the client waits for room to write, it reads: for as many units on their way as one likes
  bool reads = false;
};

[[nodiscard]] std::unique_ptr<Peer> makeTcpPeer(const TcpOptions& options);

}  // namespace mpf::bench
