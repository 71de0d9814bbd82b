// SPDX-License-Identifier: MIT
// Raw TCP: two programs without a message system: plain sockets with TCP_NODELAY, and a server that
// echoes.
#pragma once

#include <cstddef>
#include <memory>

#include "benchmarks/peers/peer.h"
#include "benchmarks/remote/surroundings.h"

namespace mpf::bench {

struct TcpOptions {
  Surroundings between;
  // Bytes of one write, and bytes that the server reads before it writes them back.
  std::size_t unitBytes = 4;
  // The client reads while it waits for room to write, so that any number of units may be
  // outstanding.
  bool reads = false;
};

[[nodiscard]] std::unique_ptr<Peer> makeTcpPeer(const TcpOptions& options);

}  // namespace mpf::bench
